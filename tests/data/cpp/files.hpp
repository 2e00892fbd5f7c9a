// Arrays in files of raw numbers.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

inline std::string folder;

template <typename T> std::vector<T> read_file(const std::string& name) {
    std::FILE* file = std::fopen((folder + "/" + name).c_str(), "rb");
    if (file == nullptr) std::abort();
    std::vector<T> found;
    T one;
    while (std::fread(&one, sizeof(T), 1, file) == 1) found.push_back(one);
    std::fclose(file);
    return found;
}

template <typename T> void write_file(const std::string& name, const std::vector<T>& cells) {
    std::FILE* file = std::fopen((folder + "/" + name).c_str(), "wb");
    if (file == nullptr || std::fwrite(cells.data(), sizeof(T), cells.size(), file) != cells.size()) std::abort();
    std::fclose(file);
}
