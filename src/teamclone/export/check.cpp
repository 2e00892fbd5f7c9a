// Answers to the states in a folder, so many times each; leaves statuses, answers and microseconds there.
// `teamclone export --check` compiles and runs it, and compares the answers with those of the network in Python.
#include "teamclone.hpp"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

using namespace teamclone::v1;

namespace {

std::string folder;

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

template <typename T> void fill(T* to, const std::vector<float>& from, std::size_t index, std::size_t count) {
    std::memcpy(static_cast<void*>(to), from.data() + index * count, count * sizeof(float));
}

}  // namespace

int main(int, char** given) {
    folder = given[1];
    const int repeats = std::stoi(given[2]);
    const auto ball = read_file<float>("ball"), players = read_file<float>("players"), types = read_file<float>("types"), server = read_file<float>("server");
    const auto past_ball = read_file<float>("past_ball"), past_players = read_file<float>("past_players"), mode_cycles = read_file<float>("mode_cycles");
    const auto past_known = read_file<unsigned char>("past_known");
    const auto mode = read_file<rt::Int>("mode"), actor = read_file<rt::Int>("actor");
    static Clone clone;
    const Status loaded = clone.load((folder + "/weights.bin").c_str());
    if (loaded != Status::ok) return std::fprintf(stderr, "%s\n", text(loaded)), 1;
    std::vector<rt::Int> statuses;
    std::vector<double> answers, micros;
    State state;
    for (std::size_t index = 0; index < actor.size(); ++index) {
        fill(&state.now.ball, ball, index, 4);
        fill(state.now.players, players, index, N_PLAYERS * N_CHANNELS);
        fill(state.types, types, index, N_PLAYERS * N_TYPE);
        fill(&state.server, server, index, N_SERVER);
        for (std::size_t back = 0; back < PAST_FRAMES; ++back) {
            fill(&state.past[back].ball, past_ball, index * PAST_FRAMES + back, 4);
            fill(state.past[back].players, past_players, index * PAST_FRAMES + back, N_PLAYERS * N_CHANNELS);
            state.past_known[back] = past_known[index * PAST_FRAMES + back] != 0;
        }
        state.mode = static_cast<int>(mode[index]);
        state.mode_cycles = mode_cycles[index];
        Status status = Status::ok;
        for (int repeat = 0; repeat < repeats; ++repeat) {
            const auto start = std::chrono::steady_clock::now();
            status = clone.see(state);
            if (status == Status::ok) status = clone.answer(static_cast<int>(actor[index]));
            micros.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
        }
        statuses.push_back(static_cast<rt::Int>(status));
        answers.push_back(clone.near_the_ball());
        for (int command = 0; command < clone.commands(); ++command) {
            const Action action = clone.point(command);
            answers.insert(answers.end(), {clone.probability(command), action.numbers[0], action.numbers[1]});
        }
        const double uniforms[UNIFORMS] = {0.3, 0.6, 0.2, 0.9, 0.5};
        const Action drawn = clone.sample(uniforms);
        answers.insert(answers.end(), {static_cast<double>(clone.likeliest().command), static_cast<double>(drawn.command), drawn.numbers[0], drawn.numbers[1]});
    }
    write_file("statuses", statuses);
    write_file("answered", answers);
    write_file("micros", micros);
}
