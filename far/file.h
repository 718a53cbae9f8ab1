// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string>

#include <osdx/result.h>

/// The one door to the file system: whatever reads or writes a file does it here.
namespace osdx::inline OSDX_ABI {

/// All bytes of a file or a pipe.
/// \return FileUnreadable; also for folders and devices, and beyond 64 GiB
OSDX_API Result<std::string> read_file(const std::filesystem::path& path);

/// Lets `write` fill a stream, and gives the file its name only when that succeeded: a
/// temporary file beside `path` is renamed, or removed; what `write` throws passes through.
/// \return WriteFailed, also if `write` leaves the stream in a failed state or if `path`
///         names a folder or a device.
OSDX_API Status write_file(const std::filesystem::path& path,
                           const std::function<void(std::ostream&)>& write);

}  // namespace osdx::inline OSDX_ABI
