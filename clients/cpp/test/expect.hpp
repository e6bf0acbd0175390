// What the tests of the client check with: the first check that fails ends the program.
#pragma once

#include <cstdlib>
#include <iostream>
#include <string>

#include <vsj_link.hpp>

inline void expect(bool is_so, const std::string& what) {
    if (is_so) return;
    std::cerr << "expected: " << what << '\n';
    std::exit(1);
}

template <typename Work>
std::string error_of(Work work) {
    try {
        work();
    } catch (const vsj::Error& error) {
        return error.what();
    }
    return "";
}

inline bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }
