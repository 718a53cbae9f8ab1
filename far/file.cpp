// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <ostream>
#include <random>
#include <streambuf>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <osdx/file.h>

namespace osdx::inline OSDX_ABI {
namespace {

namespace fs = std::filesystem;

std::string reason(int error) {
    return std::generic_category().message(error);
}

/// An open file, closed at the end of the scope.
class Descriptor {
public:
    explicit Descriptor(int number) : number_(number) {}
    Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
    Descriptor& operator=(Descriptor&&) = delete;
    ~Descriptor() {
        if (number_ >= 0)
            ::close(number_);
    }

    int get() const noexcept { return number_; }
    bool is_open() const noexcept { return number_ >= 0; }
    /// \return the error, or 0; what was written may be refused only now
    int close() { return ::close(std::exchange(number_, -1)) == 0 ? 0 : errno; }

private:
    int number_;
};

/// What a path stands for: an open file of this process, or a path without links at its end.
struct Place {
    int descriptor = -1;
    fs::path path;
};

/// The number N of a path /dev/fd/N, /proc/self/fd/N, /dev/stdout; -1 for another.
int descriptor_of(const fs::path& path) {
    constexpr std::array<std::string_view, 3> kStandard = {"/dev/stdin", "/dev/stdout",
                                                           "/dev/stderr"};
    const auto* const standard = std::ranges::find(kStandard, path.native());
    if (standard != kStandard.end())
        return static_cast<int>(standard - kStandard.begin());
    const std::string name = path.filename().string();
    int number = -1;
    const auto [end, error] =
        std::from_chars(name.data(), name.data() + name.size(), number);
    if (error != std::errc() || end != name.data() + name.size() || number < 0)
        return -1;
    std::error_code ignored;
    const fs::path folder = fs::canonical(path.parent_path(), ignored);
    return folder == "/dev/fd" || folder == fmt::format("/proc/{}/fd", getpid()) ? number
                                                                                 : -1;
}

/// Follows the links of a path, also to a file that is not there yet.
Result<Place> find_place(fs::path path) {
    constexpr int kMaxLinks = 40;  // as the kernel has it
    for (int i = 0; i <= kMaxLinks; ++i) {
        if (const int descriptor = descriptor_of(path); descriptor >= 0)
            return Place{descriptor, std::move(path)};
        std::error_code no_link;
        const fs::path target = fs::read_symlink(path, no_link);
        if (no_link)
            return Place{-1, std::move(path)};
        path = path.parent_path() / target;  // the target alone where it is absolute
    }
    return fail(ErrorCode::WriteFailed, "the links of the path have no end");
}

/// Temporary files that are there now, with their names: whoever takes a name out of its place
/// owns it. More than these at a time are not known to remove_unfinished_files().
std::array<std::atomic<char*>, 64> unfinished{};
std::atomic<char*> handed_over;  // the last name that was taken: nobody frees it

/// A file of a name that nobody knows before, in the place of another that it will replace. Gone
/// at the end of the scope, unless it was renamed before.
class TemporaryFile {
public:
    /// \param mode  without what the process masks
    TemporaryFile(const fs::path& folder, mode_t mode) {
        std::random_device random;
        // That a name is taken does not happen by chance twice.
        for (int i = 0; i < 8 && file_ < 0; ++i) {
            std::string name = ".osdx-";
            for (int k = 0; k < 4; ++k)
                name += fmt::format("{:08x}", random());
            path_ = folder / (name + ".tmp");
            enlist();
            file_ = ::open(path_.c_str(),
                           O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode);
            error_ = file_ < 0 ? errno : 0;
            if (file_ >= 0 && place_ && place_->load() != name_)
                ::unlink(path_.c_str());  // the signal came before the file
            if (file_ < 0) {
                delist();
                if (error_ != EEXIST)
                    break;
            }
        }
    }
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;
    ~TemporaryFile() {
        if (file_ >= 0 && !renamed_)
            ::unlink(path_.c_str());
        delist();
    }

    /// Why there is no file; 0 where there is one.
    int error() const noexcept { return error_; }
    /// The open file, for the caller to close.
    int file() const noexcept { return file_; }
    const fs::path& path() const noexcept { return path_; }

    int rename(const fs::path& to) {
        if (::rename(path_.c_str(), to.c_str()) != 0)
            return errno;
        renamed_ = true;
        return 0;
    }

private:
    void enlist() {
        name_ = ::strdup(path_.c_str());
        place_ = nullptr;
        for (std::atomic<char*>& place : unfinished) {
            char* free_place = nullptr;
            if (place.compare_exchange_strong(free_place, name_)) {
                place_ = &place;
                return;
            }
        }
    }
    void delist() {
        char* own = name_;
        // Whoever handles a signal has the name, until the end of the process.
        if (!place_ || place_->compare_exchange_strong(own, nullptr))
            std::free(name_);
        else
            handed_over = name_;
        place_ = nullptr;
        name_ = nullptr;
    }

    fs::path path_;
    char* name_ = nullptr;
    std::atomic<char*>* place_ = nullptr;
    int file_ = -1;
    int error_ = 0;
    bool renamed_ = false;
};

/// After a read or write that failed: whether it was for the time being only, which is waited for.
bool may_try_again(int file, short event) {
    if (errno != EAGAIN)
        return errno == EINTR;
    pollfd wait = {file, event, 0};
    return ::poll(&wait, 1, -1) >= 0 || errno == EINTR;
}

/// A stream's way to an open file. Keeps the reason of the first failure.
class DescriptorBuffer : public std::streambuf {
public:
    explicit DescriptorBuffer(int file) : file_(file), buffer_(1 << 16) { reset(); }

    int error() const noexcept { return error_; }

protected:
    int_type overflow(int_type c) override {
        if (sync() != 0)
            return traits_type::eof();
        if (!traits_type::eq_int_type(c, traits_type::eof())) {
            *pptr() = traits_type::to_char_type(c);
            pbump(1);
        }
        return traits_type::not_eof(c);
    }
    std::streamsize xsputn(const char* data, std::streamsize n) override {
        if (n <= epptr() - pptr()) {
            std::memcpy(pptr(), data, static_cast<std::size_t>(n));
            pbump(static_cast<int>(n));
            return n;
        }
        return sync() == 0 && write_all(data, static_cast<std::size_t>(n)) ? n : 0;
    }
    int sync() override {
        const bool written =
            write_all(pbase(), static_cast<std::size_t>(pptr() - pbase()));
        reset();
        return written ? 0 : -1;
    }

private:
    void reset() { setp(buffer_.data(), buffer_.data() + buffer_.size()); }
    bool write_all(const char* data, std::size_t n) {
        while (n > 0 && error_ == 0) {
            const ssize_t written = ::write(file_, data, n);
            if (written < 0) {
                if (!may_try_again(file_, POLLOUT))
                    error_ = errno;
                continue;
            }
            data += written;
            n -= static_cast<std::size_t>(written);
        }
        return error_ == 0;
    }

    int file_;
    int error_ = 0;
    std::vector<char> buffer_;
};

Status fill(Descriptor file, const std::function<void(std::ostream&)>& write) {
    DescriptorBuffer buffer(file.get());
    std::ostream stream(&buffer);
    write(stream);
    stream.flush();
    const int close_error = file.close();
    if (stream && close_error == 0)
        return ok();
    const int error = buffer.error() != 0 ? buffer.error() : close_error;
    return fail(ErrorCode::WriteFailed,
                error == 0
                    ? "the disk did not take all of the data"
                    : fmt::format("the data cannot be written: {}", reason(error)));
}

/// What the path of an output names.
struct Target {
    Place place;
    bool exists = false;
    struct stat status = {};

    bool is_straight() const {
        return place.descriptor >= 0 || (exists && !S_ISREG(status.st_mode));
    }
    fs::path folder() const {
        const fs::path parent = place.path.parent_path();
        return parent.empty() ? fs::path(".") : parent;
    }
};

/// \return WriteFailed where the path alone tells that nothing can be written
Result<Target> find_target(const fs::path& path) {
    Result<Place> place = find_place(path);
    if (!place)
        return place.error();
    Target target{std::move(*place)};
    const auto refuse = [](std::string why) {
        return fail(ErrorCode::WriteFailed, std::move(why));
    };
    if (const int n = target.place.descriptor; n >= 0) {
        const int flags = fcntl(n, F_GETFL);
        if (flags < 0 || fstat(n, &target.status) != 0)
            return refuse(fmt::format("there is no such open file: {}", reason(errno)));
        if ((flags & O_ACCMODE) == O_RDONLY)
            return refuse("the open file is not open for writing");
        target.exists = true;
        return target;
    }
    const fs::path& at = target.place.path;
    target.exists = ::stat(at.c_str(), &target.status) == 0;
    if (at.filename().empty() || (target.exists && S_ISDIR(target.status.st_mode)))
        return refuse("the path names a folder");
    if (!target.exists)
        return target;
    // The superuser may write all: the mode says what is meant.
    if ((target.status.st_mode & 0222) == 0)
        return refuse("the file is read-only");
    if (faccessat(AT_FDCWD, at.c_str(), W_OK, AT_EACCESS) != 0)
        return refuse(fmt::format("the file cannot be written: {}", reason(errno)));
    return target;
}

Error no_file_made(int error) {
    return fail(ErrorCode::WriteFailed,
                fmt::format("no file can be made in its folder: {}", reason(error)));
}

/// Gives a new file the owner of an old one, as far as the system lets it, and its mode: with less
/// where that would let others do more.
bool take_over(const struct stat& old, int file) {
    constexpr auto kSame = static_cast<uid_t>(-1);
    mode_t mode = old.st_mode & 07777;
    if (fchown(file, kSame, old.st_gid) != 0)
        mode = (mode & 01707) | ((mode & 07) << 3);  // another group: as all
    if (fchown(file, old.st_uid, kSame) != 0)
        mode &= 01777;
    return fchmod(file, mode) == 0;
}

Status write_straight(const Target& target,
                      const std::function<void(std::ostream&)>& write) {
    const int n = target.place.descriptor;
    Descriptor file(
        n >= 0 ? fcntl(n, F_DUPFD_CLOEXEC, 0)
               : ::open(target.place.path.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY));
    if (!file.is_open()) {
        return fail(ErrorCode::WriteFailed,
                    fmt::format("the file cannot be opened: {}", reason(errno)));
    }
    return fill(std::move(file), write);
}

}  // namespace

Result<std::string> read_file(const fs::path& path) {
    std::error_code ignored;
    if (fs::is_directory(path, ignored))
        return fail(ErrorCode::FileUnreadable, "the path names a directory");
    const Result<Place> place = find_place(path);
    const int n = place ? place->descriptor : -1;
    const Descriptor file(n >= 0 ? fcntl(n, F_DUPFD_CLOEXEC, 0)
                                 : ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY));
    if (!file.is_open()) {
        return fail(ErrorCode::FileUnreadable,
                    fmt::format("the file cannot be opened: {}", reason(errno)));
    }
    struct stat status = {};
    if (fstat(file.get(), &status) != 0)
        status = {};
    // What is typed at a terminal has an end.
    if (S_ISBLK(status.st_mode) || (S_ISCHR(status.st_mode) && !isatty(file.get()))) {
        return fail(ErrorCode::FileUnreadable,
                    "the path names a device, which is neither a file nor a pipe");
    }
    // Of a file the size is known; a pipe grows.
    std::string text;
    std::size_t size = 0;
    constexpr std::size_t kMostBytes = std::size_t(1) << 36;
    const Error too_long =
        fail(ErrorCode::FileUnreadable, "the file is longer than 64 GiB");
    const bool is_file = S_ISREG(status.st_mode);
    if (is_file && static_cast<std::size_t>(status.st_size) > kMostBytes)
        return too_long;
    constexpr std::size_t kBlock = 1 << 16;
    text.resize(is_file ? std::max(kBlock, static_cast<std::size_t>(status.st_size) + 1)
                        : kBlock);
    for (;;) {
        const ssize_t n_read = ::read(file.get(), text.data() + size, text.size() - size);
        if (n_read < 0 && may_try_again(file.get(), POLLIN))
            continue;
        if (n_read < 0) {
            return fail(
                ErrorCode::FileUnreadable,
                fmt::format("the file cannot be read to its end: {}", reason(errno)));
        }
        if (n_read == 0)
            break;
        size += static_cast<std::size_t>(n_read);
        if (size > kMostBytes)
            return too_long;
        if (size == text.size())
            text.resize(2 * size);
    }
    text.resize(size);
    return text;
}

Status write_file(const fs::path& path, const std::function<void(std::ostream&)>& write) {
    const Result<Target> target = find_target(path);
    if (!target)
        return target.error();
    if (target->is_straight())
        return write_straight(*target, write);
    // Of an old file none but its readers may read the new one, at no time.
    TemporaryFile temporary(target->folder(), target->exists ? 0600 : 0666);
    if (temporary.error() != 0)
        return no_file_made(temporary.error());
    Descriptor file(temporary.file());
    if (target->exists && !take_over(target->status, file.get()))
        return no_file_made(errno);
    if (Status status = fill(std::move(file), write); !status)
        return status;
    if (const int error = temporary.rename(target->place.path); error != 0) {
        return fail(ErrorCode::WriteFailed,
                    fmt::format("the file cannot be given its name: {}", reason(error)));
    }
    return ok();
}

Status check_writable(const fs::path& path) {
    const Result<Target> target = find_target(path);
    if (!target)
        return target.error();
    if (target->is_straight())
        return ok();
    const TemporaryFile temporary(target->folder(), 0600);
    if (temporary.error() != 0)
        return no_file_made(temporary.error());
    const Descriptor closed_at_end(temporary.file());
    return ok();
}

bool is_same_output(const fs::path& a, const fs::path& b) {
    const Result<Target> at_a = find_target(a), at_b = find_target(b);
    if (!at_a || !at_b)
        return false;
    const int n = at_a->place.descriptor;
    if (n >= 0 && n == at_b->place.descriptor)
        return true;
    if (at_a->exists != at_b->exists)
        return false;
    if (at_a->exists) {
        const struct stat &s = at_a->status, &t = at_b->status;
        const bool is_one = s.st_dev == t.st_dev && s.st_ino == t.st_ino;
        return is_one && !S_ISCHR(s.st_mode) && !S_ISBLK(s.st_mode);
    }
    std::error_code ignored;
    return at_a->place.path.filename() == at_b->place.path.filename() &&
           fs::equivalent(at_a->folder(), at_b->folder(), ignored);
}

void remove_unfinished_files() noexcept {
    static_assert(std::atomic<char*>::is_always_lock_free, "a handler must not wait");
    for (std::atomic<char*>& place : unfinished) {
        if (const char* const name = place.exchange(nullptr))
            ::unlink(name);  // the name is not freed: that is not safe in a handler
    }
}

}  // namespace osdx::inline OSDX_ABI
