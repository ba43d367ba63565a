// Shortens the half-precision weights of Farbrausch, so that they compress better. The page computes with weights of 7 bits, to
// which pack_byte_convolution() (nn/ldi/convolution.hpp) rounds the file's weights. Each weight is replaced by the number with the
// fewest binary digits that is rounded to the same 7 bits. The largest weight of each output, which determines the rounding, stays.

const fraction = (bits) => bits & 0x3ff;

/** Value of a finite half-precision number. @param {number} bits */
function valueOf(bits) {
    const sign = bits & 0x8000 ? -1 : 1, exponent = (bits >> 10) & 0x1f;
    return sign * (exponent === 0 ? fraction(bits) * 2 ** -24 : (1024 + fraction(bits)) * 2 ** (exponent - 25));
}

/**
 * Returns the half-precision number with the fewest digits whose value is between two limits, or undefined.
 *
 * @param {number} low   lower limit, 0 or more
 * @param {number} high  upper limit, finite
 */
function shortest(low, high) {
    if (low <= 0) return 0;
    const exponent = Math.max(Math.floor(Math.log2(low)), -14);
    for (let step = 2 ** exponent; step >= 2 ** (exponent - 10); step /= 2) {
        const value = Math.ceil(low / step) * step;
        if (value > high) continue;
        const top = Math.max(Math.floor(Math.log2(value)), -14);
        if (top > 15) return undefined;
        const digits = Math.round(value / 2 ** (top - 10)); // 1024 or more, unless the number is subnormal
        return digits < 1024 ? digits : ((top + 15) << 10) | (digits - 1024);
    }
    return undefined;
}

/**
 * Returns a copy of a safetensors file with shorter weights. All tensors have half precision, except for the ranges.
 *
 * @param {Buffer} file  weights of Farbrausch with value ranges
 */
export function shortened(file) {
    const header = 8 + Number(file.readBigUInt64LE(0));
    const tensors = JSON.parse(file.toString("utf8", 8, header));
    for (const [name, { dtype }] of Object.entries(tensors))
        if (name !== "__metadata__" && dtype !== (name.endsWith(".range") ? "F32" : "F16")) throw new Error(`${name} has values of type ${dtype}`);
    const result = Buffer.from(file);
    const place = (name, i) => header + tensors[name].data_offsets[0] + 2 * i;
    const read = (name, i) => valueOf(file.readUInt16LE(place(name, i)));
    const scale = (name) => file.readFloatLE(place(`${name}.range`, 2)) - file.readFloatLE(place(`${name}.range`, 0)); // up to a factor
    const depth = Object.keys(tensors).filter((name) => /^encoder\.\d+\.weight$/.test(name)).length;
    const encoder = (i) => (i < 0 ? "input" : `encoder.${i}`);

    for (const name of Object.keys(tensors).filter((key) => key.endsWith(".weight"))) {
        const [kind, number] = name.split(".");
        const level = Number(number);
        // A stage of the decoder reads the result of the stage before it, and then the input of the encoder's stage on its level.
        const skip = encoder(kind === "encoder" ? level - 1 : depth - 2 - level);
        const above = level === 0 ? encoder(depth - 1) : `decoder.${level - 1}`;
        const [outputs, inputs, height, width] = tensors[name].shape;
        const ofAbove = kind === "encoder" ? 0 : tensors[`${above}.weight`].shape[0];
        const scales = Array.from({ length: inputs }, (_, i) => scale(i < ofAbove ? above : skip));
        const perInput = height * width, perOutput = inputs * perInput;
        for (let output = 0; output < outputs; ++output) {
            const product = (i) => Math.abs(read(name, output * perOutput + i)) * scales[Math.floor(i / perInput)];
            let largest = 0;
            for (let i = 0; i < perOutput; ++i) largest = Math.max(largest, product(i));
            const step = largest / 63;
            for (let i = 0; i < perOutput; ++i) {
                const rounded = Math.round(product(i) / step);
                // Weights near the middle between two numbers of 7 bits, and near the largest weight, do not change.
                const margin = 1e-3;
                if (!(Math.abs(product(i) / step - rounded) < 0.5 - margin && product(i) < largest * (1 - margin))) continue;
                const ofScale = step / scales[Math.floor(i / perInput)];
                const high = Math.min(rounded + 0.5 - margin, 63 * (1 - margin));
                const bits = shortest((rounded - 0.5 + margin) * ofScale, high * ofScale);
                if (bits === undefined) continue;
                const at = place(name, output * perOutput + i);
                result.writeUInt16LE(bits === 0 ? 0 : (file.readUInt16LE(at) & 0x8000) | bits, at);
            }
        }
    }
    return result;
}
