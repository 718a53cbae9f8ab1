// Copyright 2026 The osdx authors.
// SPDX-License-Identifier: Apache-2.0

#include <filesystem>
#include <fstream>
#include <iterator>
#include <ostream>
#include <string>
#include <thread>

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <osdx/file.h>

#include "tests/support/test_folder.h"

namespace osdx {
namespace {

namespace fs = std::filesystem;
using test::content, test::TestFolder;

class File : public TestFolder {
protected:
    /// A file of text, with a mode.
    fs::path make(const std::string& name, const std::string& text, mode_t mode = 0644) {
        const fs::path path = folder_ / name;
        std::ofstream(path) << text;
        EXPECT_EQ(chmod(path.c_str(), mode), 0);
        return path;
    }
};

mode_t mode_of(const fs::path& path) {
    struct stat status = {};
    EXPECT_EQ(stat(path.c_str(), &status), 0);
    return status.st_mode & 07777;
}

void write_new(std::ostream& stream) {
    stream << "new";
}

void expect_refused(const fs::path& path, const std::string& why) {
    for (const Status& status : {write_file(path, write_new), check_writable(path)}) {
        ASSERT_FALSE(status) << path;
        EXPECT_EQ(status.error().code, ErrorCode::WriteFailed);
        EXPECT_NE(status.error().message.find(why), std::string::npos)
            << status.error().message;
    }
}

TEST_F(File, ALinkStaysAndWhatItNamesIsReplaced) {
    const fs::path target = make("target", "old", 0600);
    fs::create_directory(folder_ / "sub");
    fs::create_symlink("../target", folder_ / "sub/near");
    fs::create_symlink("sub/near", folder_ / "far");
    fs::create_symlink("sub/missing", folder_ / "dangling");
    ASSERT_TRUE(write_file(folder_ / "far", write_new));
    EXPECT_TRUE(fs::is_symlink(folder_ / "far"));
    EXPECT_TRUE(fs::is_symlink(folder_ / "sub/near"));
    EXPECT_EQ(content(target), "new");
    EXPECT_EQ(mode_of(target), 0600);
    ASSERT_TRUE(write_file(folder_ / "dangling", write_new));
    EXPECT_TRUE(fs::is_symlink(folder_ / "dangling"));
    EXPECT_EQ(content(folder_ / "sub/missing"), "new");
    EXPECT_EQ(n_files(), 4);

    fs::create_symlink("circle", folder_ / "circle");
    expect_refused(folder_ / "circle", "no end");
}

TEST_F(File, ModesStayAndNewFilesHaveThatOfTheProcess) {
    const mode_t mask = umask(027);
    for (const mode_t mode : {0600, 0644, 0666, 0755, 0200}) {
        const fs::path path = make("old", "old", mode);
        ASSERT_TRUE(write_file(path, [&](std::ostream& stream) {
            stream << "new" << std::flush;
            // The folder holds both: what comes is no more open than what was.
            for (const auto& entry : fs::directory_iterator(folder_))
                EXPECT_EQ(mode_of(entry), mode);
        }));
        EXPECT_EQ(mode_of(path), mode);
        fs::remove(path);
    }
    ASSERT_TRUE(write_file(folder_ / "fresh", write_new));
    EXPECT_EQ(mode_of(folder_ / "fresh"), 0640);
    umask(mask);
}

TEST_F(File, ReadOnlyFilesAreRefused) {
    for (const mode_t mode : {0400, 0444, 0555}) {
        const fs::path path = make("kept", "old", mode);
        expect_refused(path, "read-only");
        EXPECT_EQ(content(path), "old");
        EXPECT_EQ(mode_of(path), mode);
        fs::remove(path);
    }
}

TEST_F(File, TheTemporaryNameIsAnotherEachTime) {
    const auto name_within = [&] {
        std::string name;
        EXPECT_TRUE(write_file(folder_ / "file", [&](std::ostream&) {
            for (const auto& entry : fs::directory_iterator(folder_)) {
                if (entry.path().filename() != "file")
                    name = entry.path().filename().string();
            }
        }));
        return name;
    };
    const std::string first = name_within();
    EXPECT_GE(first.size(), 32U);  // 128 bits
    EXPECT_NE(first, name_within());
    // However long the name of the file is.
    EXPECT_TRUE(write_file(folder_ / std::string(255, 'x'), write_new));
}

TEST_F(File, NoTemporaryOutlivesTheEndByASignal) {
    const fs::path path = make("file", "old");
    const Status status = write_file(path, [&](std::ostream& stream) {
        stream << "new" << std::flush;
        EXPECT_EQ(n_files(), 2);
        remove_unfinished_files();
        EXPECT_EQ(n_files(), 1);
    });
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::WriteFailed);
    EXPECT_EQ(content(path), "old");
    EXPECT_EQ(n_files(), 1);
    // Nothing of those that are whole is forgotten there.
    ASSERT_TRUE(write_file(path, write_new));
    remove_unfinished_files();
    EXPECT_EQ(content(path), "new");
}

TEST_F(File, PipesAndDevicesAreWrittenStraight) {
    const fs::path pipe = folder_ / "pipe";
    ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
    EXPECT_TRUE(check_writable(pipe));
    Result<std::string> text = std::string();
    std::thread reader([&] { text = read_file(pipe); });
    const std::string sent(300000, 'x');  // more than a pipe holds
    EXPECT_TRUE(write_file(pipe, [&](std::ostream& stream) { stream << sent; }));
    reader.join();
    ASSERT_TRUE(text);
    EXPECT_EQ(*text, sent);
    EXPECT_TRUE(fs::is_fifo(pipe));
    EXPECT_EQ(n_files(), 1);

    EXPECT_TRUE(write_file("/dev/null", write_new));
    EXPECT_TRUE(fs::is_character_file("/dev/null"));
    if (fs::exists("/dev/full")) {
        EXPECT_TRUE(check_writable("/dev/full"));
        const Status full = write_file("/dev/full", write_new);
        ASSERT_FALSE(full);
        EXPECT_NE(full.error().message.find("No space"), std::string::npos)
            << full.error().message;
    }
}

TEST_F(File, OpenFilesAreTakenAsTheyStand) {
    const fs::path path = make("log", "first ");
    const int file = open(path.c_str(), O_RDWR | O_APPEND);
    ASSERT_GE(file, 0);
    const fs::path name = fmt::format("/dev/fd/{}", file);
    fs::create_symlink(name, folder_ / "link");
    EXPECT_TRUE(write_file(name, write_new));
    EXPECT_TRUE(write_file(folder_ / "link", write_new));
    EXPECT_EQ(content(path), "first newnew");
    EXPECT_TRUE(is_same_output(name, folder_ / "link"));
    EXPECT_TRUE(is_same_output(name, path));
    EXPECT_FALSE(is_same_output("/dev/stdout", name));
    ASSERT_EQ(lseek(file, 6, SEEK_SET), 6);
    const Result<std::string> rest = read_file(name);
    ASSERT_TRUE(rest);
    EXPECT_EQ(*rest, "newnew");
    close(file);
    expect_refused(name, "no such open file");

    const int input = open(path.c_str(), O_RDONLY);
    expect_refused(fmt::format("/dev/fd/{}", input), "not open for writing");
    close(input);
}

TEST_F(File, OutputsAreTried) {
    EXPECT_TRUE(check_writable(folder_ / "fresh"));
    EXPECT_TRUE(check_writable(make("old", "old")));
    EXPECT_EQ(n_files(), 1);
    EXPECT_EQ(content(folder_ / "old"), "old");
    expect_refused(folder_, "folder");
    expect_refused(folder_ / "", "folder");
    expect_refused(folder_ / "missing" / "file", "no file can be made in its folder");
    expect_refused(folder_ / "old" / "file", "no file can be made in its folder");
}

TEST_F(File, OutputsThatMeetAreKnown) {
    const fs::path old = make("old", "old");
    fs::create_symlink("old", folder_ / "link");
    fs::create_symlink("fresh", folder_ / "dangling");
    fs::create_directory_symlink(".", folder_ / "here");
    EXPECT_TRUE(is_same_output(old, folder_ / "link"));
    EXPECT_TRUE(is_same_output(old, folder_ / "here/old"));
    EXPECT_TRUE(is_same_output(folder_ / "fresh", folder_ / "here/fresh"));
    EXPECT_TRUE(is_same_output(folder_ / "fresh", folder_ / "dangling"));
    EXPECT_FALSE(is_same_output(folder_ / "fresh", folder_ / "other"));
    EXPECT_FALSE(is_same_output(old, folder_ / "fresh"));
    EXPECT_FALSE(is_same_output("/dev/null", "/dev/null"));
}

}  // namespace
}  // namespace osdx
