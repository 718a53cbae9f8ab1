// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cassert>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>

#include <osdx/types.h>

namespace osdx::inline OSDX_ABI {

enum class ErrorCode : std::uint8_t {
    FileUnreadable,     ///< the file does not exist or cannot be opened
    FileFormat,         ///< the text or bytes do not follow the format
    EmptyMesh,          ///< no vertices or no faces
    SizeMismatch,       ///< two arrays that must match in length do not
    IndexOutOfRange,    ///< a face names a vertex that does not exist
    FaceTooSmall,       ///< a face has fewer than three vertices
    RepeatedVertex,     ///< a face names a vertex twice
    NonFinitePoint,     ///< a position is NaN, infinite or out of range
    NonManifoldEdge,    ///< an edge has three or more faces
    OppositeFaces,      ///< two faces run along their common edge in the same direction
    NonManifoldVertex,  ///< a vertex has two or more fans of faces
    InvalidFeature,     ///< a crease, corner or hole names what is not there
    InvalidTag,         ///< a tag names what is not there, or holds the wrong values
    UnsupportedTag,     ///< a tag changes the surface in a way that is not supported
    ValenceTwo,         ///< an interior vertex has two faces only, which surfaces refuse
    NotIsolated,        ///< no refinement makes the surroundings of a face regular
    NoTexcoords,        ///< the mesh has no texture coordinates
    InvalidOption,      ///< an option is outside the range that its comment states
    DeviceFailure,      ///< Embree refused the request
    NotBuilt,           ///< the library was built without the part that this needs
    WriteFailed,        ///< a file could not be written
    Cancelled,          ///< by a Progress
};

/// Why a function refused its input.
struct Error {
    ErrorCode code;
    std::string message;            ///< one sentence for a person; names the element
    Index element = kInvalidIndex;  ///< the vertex, edge or face at fault, if any
    Index line = 0;                 ///< line of the input file, counted from 1; 0: none
};

/// A value, or the reason there is none. Member names follow std::expected (C++23), so
/// that this class can become an alias of it.
template <class T>
class [[nodiscard]] Result {
public:
    Result(T value) : state_(std::move(value)) {}
    Result(Error error) : state_(std::move(error)) {}

    bool has_value() const noexcept { return state_.index() == 0; }
    explicit operator bool() const noexcept { return has_value(); }

    T& operator*() & noexcept { return *operator->(); }
    const T& operator*() const& noexcept { return *operator->(); }
    T&& operator*() && noexcept { return std::move(*operator->()); }
    T* operator->() noexcept {
        assert(has_value());
        return std::get_if<0>(&state_);
    }
    const T* operator->() const noexcept {
        assert(has_value());
        return std::get_if<0>(&state_);
    }
    const Error& error() const noexcept {
        assert(!has_value());
        return *std::get_if<1>(&state_);
    }

private:
    std::variant<T, Error> state_;
};

/// The result of a function that has nothing to return but success.
using Status = Result<std::monostate>;
inline Status ok() {
    return std::monostate{};
}

/// `return fail(ErrorCode::NonManifoldEdge, "edge 3 7 has 3 faces", 12);`
inline Error fail(ErrorCode code, std::string message, Index element = kInvalidIndex,
                  Index line = 0) {
    return {code, std::move(message), element, line};
}

enum class WarningCode : std::uint8_t {
    MissingTexcoords,  ///< corners have no texture coordinates, though others have
    InvalidTexcoords,  ///< corners name texture coordinates that are not there or not finite
    ExtraValues,       ///< a row has more values than were announced, which are left out
    MissingHeader,     ///< the format was told by what follows its header
    OutsideFace,       ///< an address lies outside of its face and was moved to it
};

/// What was taken although it is not as it should be, and how it was taken. Of a kind there is
/// one, which names the first place and says how many there are.
struct Warning {
    WarningCode code;
    std::string message;  ///< one sentence for a person; names the element
    Index line = 0;       ///< line of the input file, counted from 1; 0: none
};

}  // namespace osdx::inline OSDX_ABI
