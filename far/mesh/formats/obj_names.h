// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <string>
#include <string_view>

#include <osdx/mesh_data.h>
#include <osdx/types.h>

#include "far/mesh/formats/output.h"

/// Groups, objects and materials in OBJ files, for the writers of meshes and tessellations.
namespace osdx::inline OSDX_ABI::detail {

/// Whether the reader of OBJ takes `text` as one word, if it is not the last of a tag.
inline bool is_word(std::string_view text) {
    return !text.empty() && text.front() != '#' &&
           std::ranges::none_of(text, [](unsigned char c) { return std::isspace(c); });
}

/// Whether the reader of OBJ takes `text` for the name that it is.
inline bool is_name(std::string_view text) {
    while (true) {
        const std::size_t end = text.find(' ');
        if (!is_word(text.substr(0, end)))
            return false;
        if (end == text.npos)
            return true;
        text.remove_prefix(end + 1);
    }
}

/// A name that the reader of OBJ would not take for what it is; or null.
inline const std::string* bad_name(const MeshData& mesh) {
    for (const auto* names : {&mesh.groups.names, &mesh.objects.names,
                              &mesh.materials.names, &mesh.material_files}) {
        const auto bad = std::ranges::find_if_not(*names, is_name);
        if (bad != names->end())
            return &*bad;
    }
    return nullptr;
}

/// Starts a name where it changes from a face to the next.
class WrittenNames {
public:
    /// Names the files of materials.
    /// \pre check_face_names(mesh), !bad_name(mesh)
    WrittenNames(Output& out, const MeshData& mesh)
        : out_(out),
          kinds_{{{"o", mesh.objects}, {"g", mesh.groups}, {"usemtl", mesh.materials}}} {
        for (const std::string& file : mesh.material_files)
            out.text("mtllib {}\n", file);
    }

    /// What is written next is the face of this number, or lies in it.
    void start_face(std::size_t f) {
        for (Kind& kind : kinds_) {
            const Index now =
                kind.names.faces.empty() ? kInvalidIndex : kind.names.faces[f];
            if (now == kind.last)
                continue;
            kind.last = now;
            if (now == kInvalidIndex)
                out_.text("{}\n", kind.keyword);
            else
                out_.text("{} {}\n", kind.keyword, kind.names.names[now]);
        }
    }

private:
    struct Kind {
        std::string_view keyword;
        const FaceNames& names;
        Index last = kInvalidIndex;
    };
    Output& out_;
    std::array<Kind, 3> kinds_;
};

}  // namespace osdx::inline OSDX_ABI::detail
