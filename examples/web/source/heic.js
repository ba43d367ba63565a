// Reads one HEIC photo in a Worker. createReader() loads the decoder, heic.wasm. Emscripten generates this function, and bundle.mjs prepends
// it to this script.
//
// Message in:    {wasm, bytes, name}
// Messages out:  {decoded: DecodedPhoto}, or {failure}
/* global createReader */

/**
 * A photo with its depth, as converter.cpp accepts it.
 *
 * @typedef {object} DecodedPhoto
 * @property {Uint8Array} color  height x width x 3
 * @property {number} height
 * @property {number} width
 * @property {number} focalLength  in millimeters on 35 mm film; 0: unknown
 * @property {string} refused  reason for not using the file's depth, or an empty text
 * @property {{disparity: Uint8Array, height: number, width: number, isInverseDepth: number, isMetric: number, isGuess: number, source: string} | null} depth
 *     disparity has the bytes of height x width floats
 */

onmessage = async ({ data: { wasm, bytes, name } }) => {
    try {
        const decoded = decode(await createReader({ wasmBinary: wasm }), bytes, new TextEncoder().encode(`${name}\0`));
        postMessage({ decoded }, [decoded.color.buffer, ...(decoded.depth ? [decoded.depth.disparity.buffer] : [])]);
    } catch (failure) {
        const isMemory = failure instanceof WebAssembly.RuntimeError || failure instanceof RangeError;
        postMessage({ failure: isMemory ? "not enough memory" : failure.message });
    }
};

/** @returns {DecodedPhoto} */
function decode(reader, bytes, name) {
    const place = reader._malloc(bytes.length + name.length);
    if (place === 0) throw new Error("not enough memory");
    reader.HEAPU8.set(bytes, place);
    reader.HEAPU8.set(name, place + bytes.length);
    const text = (address) => reader.UTF8ToString(address);
    const isDecoded = reader._heic_decode(place, bytes.length, place + bytes.length) === 1;
    if (!isDecoded) throw new Error(text(reader._heic_message()));
    const copyOf = (address, size) => reader.HEAPU8.slice(address, address + size);
    const size = { height: reader._heic_height(), width: reader._heic_width() };
    const map = { height: reader._heic_disparity_height(), width: reader._heic_disparity_width() };
    const depth = reader._heic_disparity() && {
        disparity: copyOf(reader._heic_disparity(), map.height * map.width * 4),
        ...map,
        isInverseDepth: reader._heic_is_inverse_depth(),
        isMetric: reader._heic_is_metric(),
        isGuess: reader._heic_is_guess(),
        source: text(reader._heic_depth_source()),
    };
    return {
        color: copyOf(reader._heic_color(), size.height * size.width * 3),
        ...size,
        focalLength: reader._heic_focal_length(),
        refused: text(reader._heic_refused()),
        depth: depth || null,
    };
}
