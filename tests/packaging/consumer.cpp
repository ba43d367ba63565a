// The smallest program of a user of the installed package.
#include <ldi/core/layered_image.hpp>
#include <ldi/core/validate.hpp>

int main() {
    const ldi::photo_layers layers(ldi::make_grid(4, 3));
    return layers.size() == 12 && !ldi::validate_canonical(layers.topology()) ? 0 : 1;
}
