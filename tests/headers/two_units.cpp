// Public types have the same layout in both translation units. Successful linking shows that no header defines a symbol twice.
#include "layout.hpp"

#include <cstdio>

std::vector<type_layout> first_unit();
std::vector<type_layout> second_unit();

int main() {
    const std::vector<type_layout> first = first_unit(), second = second_unit();
    if (first.empty() || first.size() != second.size()) {
        std::fputs("a translation unit found a broken graph\n", stderr);
        return 1;
    }
    for (std::size_t i = 0; i < first.size(); ++i)
        if (!(first[i] == second[i])) {
            std::fprintf(stderr, "%s: %zu bytes aligned to %zu in one translation unit, %zu to %zu in the other\n", first[i].name,
                         first[i].size, first[i].alignment, second[i].size, second[i].alignment);
            return 1;
        }
    return 0;
}
