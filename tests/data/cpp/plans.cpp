// Plans on the scenes in a folder with scratch memory of so many bytes, and leaves the plans there.
#include "teamclone.hpp"

#include <algorithm>

#include "files.hpp"

using namespace teamclone::v1;

int main(int, char** given) {
    folder = given[1];
    std::vector<unsigned char> bytes(std::stoul(given[2]));
    rt::Memory memory(bytes.data(), bytes.size());
    auto scenes = read_file<double>("scenes"), made = read_file<double>("made");
    const auto actors = read_file<rt::Int>("actors"), which = read_file<rt::Int>("which");
    auto orders = read_file<rt::Int>("orders");
    const auto shapes = read_file<rt::Int>("shapes");
    const rt::Int rows = shapes[0], columns = shapes[1], plan_columns = shapes[2], directions = shapes[3], pairs = shapes[4];
    rt::Int overflows = 0;
    for (std::size_t index = 0; index < actors.size(); ++index) {
        const rt::Int at = static_cast<rt::Int>(index);
        const rt::View<double, 2> scene(scenes.data() + at * rows * columns, {rows, columns});
        const rt::View<rt::Int, 3> order(orders.data() + which[index] * directions * pairs * 2, {directions, pairs, 2});
        overflows += !plan(memory, scene, actors[index], order, rt::View<double, 1>(made.data() + at * plan_columns, {plan_columns}));
    }
    write_file("plans", made);
    write_file("used", std::vector<rt::Int>{static_cast<rt::Int>(memory.most - memory.begin), overflows});
}
