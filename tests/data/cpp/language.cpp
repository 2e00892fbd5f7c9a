// Runs each kernel of tests/unit/export/language.py on the inputs in a folder, and leaves what it made there.
#include "teamclone.hpp"

#include "files.hpp"

using namespace teamclone::v1;

template <typename Kernel> void run(rt::Memory& memory, const Kernel& kernel, int number) {
    auto floats = read_file<double>("floats");
    auto ints = read_file<rt::Int>("ints");
    auto a = read_file<double>("a");
    auto i = read_file<rt::Int>("i");
    auto f = read_file<float>("f");
    const rt::Int columns = 40, n = static_cast<rt::Int>(a.size());
    const auto length = [](const auto& of) { return rt::Shape<1>{static_cast<rt::Int>(of.size())}; };
    const rt::Shape<2> table{static_cast<rt::Int>(floats.size()) / columns, columns};
    if (n == 0 || !kernel(memory, rt::View<double, 1>(a.data(), length(a)), rt::View<rt::Int, 1>(i.data(), length(i)),
                          rt::View<float, 1>(f.data(), length(f)), rt::View<double, 2>(floats.data(), table),
                          rt::View<rt::Int, 2>(ints.data(), table))) {
        std::abort();
    }
    write_file("floats_" + std::to_string(number), floats);
    write_file("ints_" + std::to_string(number), ints);
}

int main(int, char** given) {
    folder = given[1];
    std::vector<unsigned char> bytes(1 << 20);
    rt::Memory memory(bytes.data(), bytes.size());
    run(memory, of_floats, 0);
    run(memory, of_ints, 1);
    run(memory, of_singles, 2);
    run(memory, of_elements, 3);
    run(memory, of_arrays, 4);
    run(memory, of_slices, 5);
    run(memory, of_control, 6);
}
