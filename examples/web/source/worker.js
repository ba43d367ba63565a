// Runs the converter in a Worker, so that the page stays responsive. createConverter() is Emscripten's loader of the converter, which
// converter.js prepends to this text.
//
// Messages in:   {load: {wasm, depth, inpainting, threads}}, once. `threads`: {loader, worker}, the scripts of its threads, or null
//                {convert: {bytes, name, isExact, decoded, refusal}, id}. `decoded`: result of heic.js, or null; `refusal`: message of
//                heic.js, or an empty text
// Messages out:  {ready: {milliseconds, threads}}
//                {warm: {milliseconds}}
//                {stage, fraction, id}
//                {result: {glb, poster, width, height, isPastFrame, depthSource, stages, heap}, id}
//                {failure, isBroken, id}. `isBroken`: the converter can't be used again
/* global createConverter */

import { sizeOfPicture } from "../../viewer/source/check_glb.js";

/** Maximum number of pixels of a photo, as in the program. */
const maxPixels = 200_000_000;

/** Maximum side of a photo that the browser decodes: twice the converter's working size. */
const maxDecodedSide = 3072;

/** Minimum time between two progress messages within a stage. Sending a message takes a tenth of a millisecond. */
const progressMilliseconds = 30;

let converter;
/** Memory of a converter with threads. @type {WebAssembly.Memory | undefined} */
let shared;
let clock = () => {};
let job = null;
let queue = Promise.resolve();
/** Number of requested conversions. */
let wanted = 0;

onmessage = ({ data }) => {
    if (data.convert) wanted += 1;
    queue = queue.then(() => (data.load ? load(data.load) : convert(data.convert, data.id))).catch((failure) => {
        postMessage({ failure: messageOf(failure), isBroken: failure instanceof WebAssembly.RuntimeError, id: data.id ?? null });
    });
};

/** Returns the message of an error. WebAssembly throws a RangeError or a RuntimeError when memory runs out. */
function messageOf(failure) {
    return failure instanceof RangeError || /OOM|out of memory/.test(failure.message) ? "not enough memory" : failure.message;
}

/** Starts the converter. `weights` are those of the depth network, the inpainting network and the silhouette network. */
async function load({ wasm, weights, threads }) {
    const start = performance.now();
    const options = { wasmBinary: wasm, onProgress: (stage, fraction) => clock(stage, fraction) };
    if (threads) {
        const address = URL.createObjectURL(scriptOf(threads.worker));
        shared = new WebAssembly.Memory({ initial: 256, maximum: 16384, shared: true }); // in pages of 64 KiB, as in build.sh
        Object.assign(options, { wasmMemory: shared, mainScriptUrlOrBlob: scriptOf(threads.loader), locateFile: () => address });
    }
    converter = await createConverter(options);
    for (const [kind, file] of weights.entries()) within([file], ([data]) => check(converter._web_load(kind, data, file.length)));
    postMessage({ ready: { milliseconds: performance.now() - start, threads: converter._web_threads() } });
    warmUp(performance.now()).catch(() => {}); // the first photo will report the error
}

const scriptOf = (bytes) => new Blob([bytes], { type: "text/javascript" });

/** Returns the converter's whole memory. converter.HEAPU8 is too short after threads have enlarged the memory. */
const memory = () => (shared ? new Uint8Array(shared.buffer) : converter.HEAPU8);

/** Memory that a photo of 1152 x 1536 needs in addition to the networks, in bytes. */
const photoMemory = 100e6;

/** Writes to the memory that a photo needs. Otherwise, page faults would slow down the first photo: by 0.4 s on a virtual machine. */
async function touchMemory() {
    for (let done = 0; done < photoMemory && wanted === 0; done += 1e7) {
        const place = converter._malloc(photoMemory); // the same place each time, unless a photo arrives
        if (place) memory().fill(0, place + done, place + done + 1e7);
        converter._free(place);
        await new Promise((resolve) => setTimeout(resolve)); // lets messages arrive
    }
}

/** Warms up code and memory while the user chooses a photo; stops when a photo arrives. */
async function warmUp(start) {
    const parts = [0, 1, 2, 1, 2, 1, 2].map((part) => () => check(converter._web_warm_up(part)));
    for (const run of [...parts.slice(0, 3), touchMemory, ...parts.slice(3)]) {
        await new Promise((resolve) => setTimeout(resolve)); // lets messages arrive
        if (wanted > 0) break;
        await run();
    }
    postMessage({ warm: { milliseconds: performance.now() - start } });
}

async function convert({ bytes, name, isExact = false, decoded, refusal }, id) {
    job = { id, stages: {}, began: {}, told: 0 };
    clock = (stage, fraction) => {
        const now = performance.now();
        if (fraction === 0) job.began[stage] = now;
        if (fraction === 1) {
            job.stages[stage] = (job.stages[stage] ?? 0) + now - job.began[stage];
            job.began[stage] = now; // a stage may report its end several times
        }
        if (fraction > 0 && fraction < 1 && now - job.told < progressMilliseconds) return;
        job.told = now;
        postMessage({ stage, fraction, id });
    };
    const text = new TextEncoder().encode(`${name}\0`);
    if (decoded) accept(decoded);
    else await open(bytes, text, refusal);
    within([text], ([where]) => check(converter._web_convert(where, Number(isExact))));
    const glb = copyOf(converter._web_glb(), converter._web_glb_size());
    const poster = copyOf(converter._web_poster(), converter._web_poster_size());
    converter._web_release();
    const result = {
        glb,
        poster,
        width: converter._web_width(),
        height: converter._web_height(),
        isPastFrame: converter._web_is_past_frame() === 1,
        depthSource: converter.UTF8ToString(converter._web_depth_source()),
        stages: job.stages,
        heap: memory().length,
    };
    postMessage({ result, id }, [glb.buffer, poster.buffer]);
}

/** Decodes a photo here or in the browser. @param {Uint8Array} name  ends with 0 */
async function open(bytes, name, refusal) {
    const decoder = within([bytes, name], ([data, where]) => check(converter._web_inspect(data, bytes.length, where)));
    const pixels = decoder === 2 ? await decodeInBrowser(bytes, name, refusal) : null;
    within([bytes, name, pixels?.data], ([data, where, rgba]) => {
        check(converter._web_open(data, bytes.length, where, rgba, pixels?.height ?? 0, pixels?.width ?? 0));
    });
}

/** @param {import("./heic.js").DecodedPhoto} decoded */
function accept({ color, height, width, focalLength, refused, depth }) {
    const textOf = (text) => new TextEncoder().encode(`${text}\0`);
    clock("reading photo", 0);
    within([color, textOf(refused)], ([rgb, reason]) => check(converter._web_accept(rgb, height, width, focalLength, reason)));
    if (!depth) return;
    within([depth.disparity, textOf(depth.source)], ([disparity, source]) => {
        check(converter._web_add_depth(disparity, depth.height, depth.width, depth.isInverseDepth, depth.isMetric, depth.isGuess, source));
    });
}

/** Calls `use` with the addresses of copies of the arrays in the converter's memory; 0 for an array that is missing. */
function within(arrays, use) {
    const places = [];
    try {
        for (const array of arrays) {
            places.push(array ? converter._malloc(Math.max(array.length, 1)) : 0);
            if (!array) continue;
            if (places.at(-1) === 0) throw new Error("not enough memory");
            memory().set(array, places.at(-1));
        }
        return use(places);
    } finally {
        for (const place of places) converter._free(place);
    }
}

const copyOf = (place, size) => new Uint8Array(memory().subarray(place, place + size));

function check(result) {
    if (result === 0) throw new Error(converter.UTF8ToString(converter._web_message()));
    return result;
}

/** Returns the width and height of the largest picture in the header of an AVIF file; undefined for other files. */
function sizeInBoxes(bytes) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, Math.min(bytes.length, 65_536));
    let largest;
    for (let at = 4; at + 16 <= view.byteLength; ++at) {
        if (view.getUint32(at) !== 0x69737065) continue; // "ispe"
        const size = [view.getUint32(at + 8), view.getUint32(at + 12)];
        if (!largest || size[0] * size[1] > largest[0] * largest[1]) largest = size;
    }
    return largest;
}

/**
 * Decodes a photo with the browser: upright, in sRGB.
 *
 * @param {Uint8Array} name  ends with 0
 * @param {string} refusal  reason why heic.js could not read the photo, or an empty text
 * @returns {Promise<ImageData>} red, green, blue and alpha
 */
async function decodeInBrowser(bytes, name, refusal) {
    const size = sizeOfPicture(bytes) ?? sizeInBoxes(bytes);
    if (size && size[0] * size[1] > maxPixels) {
        const text = new TextDecoder().decode(name.subarray(0, -1));
        throw new Error(`${text}: expected at most ${maxPixels} pixels, found ${size.join(" x ")} (too large)`);
    }
    const blob = new Blob([bytes]);
    const picture = await createImageBitmap(blob, { imageOrientation: "from-image", premultiplyAlpha: "none" }).catch(() => {
        if (refusal) throw new Error(refusal);
        within([bytes, name], ([data, where]) => check(converter._web_refuse(data, bytes.length, where)));
    });
    const scale = Math.min(1, maxDecodedSide / Math.max(picture.width, picture.height));
    const [width, height] = [picture.width, picture.height].map((side) => Math.max(1, Math.round(side * scale)));
    const context = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
    context.imageSmoothingQuality = "high";
    context.drawImage(picture, 0, 0, width, height);
    picture.close();
    return context.getImageData(0, 0, width, height);
}
