// Both translation units compute the same number.
#include <cstdio>

double first_unit();
double second_unit();

int main() {
    const double first = first_unit(), second = second_unit();
    std::printf("%.0f, %.0f\n", first, second);
    return first > 0 && first == second ? 0 : 1;
}
