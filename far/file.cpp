// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <cerrno>
#include <fstream>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <unistd.h>

#include <osdx/file.h>

namespace osdx::inline OSDX_ABI {
namespace {

Result<std::ifstream> open(const std::filesystem::path& path) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored))
        return fail(ErrorCode::FileUnreadable, "the path names a directory");
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    if (!file) {
        return fail(ErrorCode::FileUnreadable,
                    fmt::format("the file cannot be opened: {}",
                                std::generic_category().message(errno)));
    }
    return file;
}

Result<std::string> read_text(std::ifstream& file) {
    file.seekg(0, std::ios::end);
    const auto size = static_cast<std::streamoff>(file.tellg());
    file.seekg(0);
    if (!file)
        return fail(ErrorCode::FileUnreadable, "the size of the file is unknown");
    std::string text(static_cast<std::size_t>(size), '\0');
    if (!file.read(text.data(), size))
        return fail(ErrorCode::FileUnreadable, "the file cannot be read to its end");
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
    return read_text(*file);
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
