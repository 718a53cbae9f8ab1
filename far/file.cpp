// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include <osdx/file.h>

namespace osdx::inline OSDX_ABI {
namespace {

/// A pipe may never end, and a file may have no data but a size.
constexpr std::size_t kMostBytes = std::size_t(1) << 36;

Result<std::ifstream> open(const std::filesystem::path& path) {
    using std::filesystem::file_type;
    std::error_code error;
    const file_type type = std::filesystem::status(path, error).type();
    if (type == file_type::directory)
        return fail(ErrorCode::FileUnreadable, "the path names a directory");
    if (type == file_type::character || type == file_type::block) {
        return fail(ErrorCode::FileUnreadable,
                    "the path names a device, which is neither a file nor a pipe");
    }
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        return fail(ErrorCode::FileUnreadable,
                    fmt::format("the file cannot be opened: {}",
                                std::generic_category().message(errno)));
    }
    return file;
}

/// The bytes from here to the end; of pipes nothing is known before.
/// \param text  has room for as many bytes as are expected
Status append_rest(std::ifstream& file, std::string& text) {
    std::size_t n = 0;
    while (true) {
        file.read(text.data() + n, static_cast<std::streamsize>(text.size() - n));
        n += static_cast<std::size_t>(file.gcount());
        if (file.bad())
            return fail(ErrorCode::FileUnreadable, "the file cannot be read to its end");
        if (n < text.size() || file.peek() == std::ifstream::traits_type::eof())
            break;
        if (n >= kMostBytes)
            return fail(ErrorCode::FileUnreadable, "the file is longer than 64 GiB");
        constexpr std::size_t kBlock = 1 << 16;  // what a pipe holds
        text.resize(std::max(2 * n, kBlock));
    }
    text.resize(n);
    return ok();
}

Result<std::string> read_text(std::ifstream& file, const std::filesystem::path& path) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(path, error);
    if (!error && size > kMostBytes)
        return fail(ErrorCode::FileUnreadable, "the file is longer than 64 GiB");
    std::string text(error ? 0 : static_cast<std::size_t>(size), '\0');
    if (const Status status = append_rest(file, text); !status)
        return status.error();
    return text;
}

/// A file that is gone at the end of the scope, unless it was renamed before.
struct TemporaryFile {
    std::filesystem::path path;

    explicit TemporaryFile(std::filesystem::path name) : path(std::move(name)) {}
    TemporaryFile(const TemporaryFile&) = delete;
    TemporaryFile& operator=(const TemporaryFile&) = delete;
    ~TemporaryFile() {
        std::error_code ignored;
        std::filesystem::remove(path, ignored);
    }
};

}  // namespace

Result<std::string> read_file(const std::filesystem::path& path) {
    auto file = open(path);
    if (!file)
        return file.error();
    return read_text(*file, path);
}

Status write_file(const std::filesystem::path& path,
                  const std::function<void(std::ostream&)>& write) {
    std::error_code error;
    const auto status = std::filesystem::status(path, error);
    if (exists(status) && !is_regular_file(status)) {
        // The rename would replace a device or a socket.
        return fail(ErrorCode::WriteFailed,
                    "the path names something that is not a file");
    }
    const TemporaryFile temporary(path.string() + fmt::format(".{}.tmp", getpid()));
    errno = 0;
    std::ofstream stream(temporary.path, std::ios::binary);
    if (!stream) {
        return fail(ErrorCode::WriteFailed,
                    fmt::format("no file can be made in its folder: {}",
                                std::generic_category().message(errno)));
    }
    write(stream);
    stream.close();
    if (!stream)
        return fail(ErrorCode::WriteFailed, "the disk did not take all of the data");
    std::filesystem::rename(temporary.path, path, error);
    if (error) {
        return fail(
            ErrorCode::WriteFailed,
            fmt::format("the file cannot be given its name: {}", error.message()));
    }
    return ok();
}

}  // namespace osdx::inline OSDX_ABI
