// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>

#include <osdx/result.h>

/// The one door to the file system: whatever reads or writes a file does it here. Paths of open
/// files, as /dev/stdin and /dev/fd/3, are those files as they stand, not opened anew.
namespace osdx::inline OSDX_ABI {

/// All bytes of a file or a pipe.
/// \return FileUnreadable; also for folders and devices, and beyond 64 GiB
OSDX_API Result<std::string> read_file(const std::filesystem::path& path);

/// Lets `write` fill a stream, and gives the file its name only when that succeeded: a
/// temporary file beside it, of a name that nobody knows before, is renamed or removed; what
/// `write` throws passes through. A link stays, and the file that it names is replaced; a file
/// that is replaced hands on its mode. Devices and pipes are written straight.
/// \return WriteFailed, also if `write` leaves the stream in a failed state or if `path` names
///         a folder, or a file that is read-only, be it to the superuser.
OSDX_API Status write_file(const std::filesystem::path& path,
                           const std::function<void(std::ostream&)>& write);

/// Whether write_file() could begin: what it would return for the path alone. Leaves no trace.
OSDX_API Status check_writable(const std::filesystem::path& path);

/// Whether what is written to both would meet in one file or pipe, be it there or not. Devices
/// are never the same, unless both are one open file.
OSDX_API bool is_same_output(const std::filesystem::path& a,
                             const std::filesystem::path& b);

/// Removes the temporary files of all calls of write_file() that run now, in any thread, which
/// fail so. For the end of a program by a signal: may be called in a handler, as all that it
/// calls is safe there.
OSDX_API void remove_unfinished_files() noexcept;

}  // namespace osdx::inline OSDX_ABI
