// Reads the other files of the page: from base64 text in the page, or from files beside the page on the server. Both are compressed.

/** Whether the page contains all files. */
export const isOneFile = () => document.getElementById("asset worker.js") !== null;

/**
 * Reads and unpacks a file. If its name ends in "halves", interleaves the bytes that bundle.mjs separated.
 *
 * @param {string} name
 * @returns {Promise<Uint8Array>}
 */
export async function readAsset(name) {
    const inPage = document.getElementById(`asset ${name}`);
    const packed = inPage ? fromBase64(inPage.textContent) : await download(`${name}.gz`);
    const bytes = await unpack(packed);
    return name.endsWith("halves") ? joinHalves(bytes) : bytes;
}

/** Unpacks a file, unless the browser has done so because the server sent it with `Content-Encoding: gzip`. @param {Uint8Array} packed */
async function unpack(packed) {
    if (packed[0] !== 0x1f || packed[1] !== 0x8b) return packed;
    const unpacked = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(unpacked).arrayBuffer());
}

function joinHalves(halves) {
    const bytes = new Uint8Array(halves.length);
    const low = Math.ceil(halves.length / 2);
    for (let i = 0; i < bytes.length; ++i) bytes[i] = halves[i % 2 === 0 ? i / 2 : low + (i - 1) / 2];
    return bytes;
}

async function download(name) {
    const response = await fetch(name);
    if (!response.ok) throw new Error(`The page is incomplete: ${name} is missing.`);
    return new Uint8Array(await response.arrayBuffer());
}

export function fromBase64(text) {
    const binary = atob(text);
    const bytes = new Uint8Array(binary.length);
    for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
    return bytes;
}

/** @param {Uint8Array} bytes */
export function toBase64(bytes) {
    let binary = "";
    const step = 0x8000; // maximum number of arguments per call
    for (let i = 0; i < bytes.length; i += step) binary += String.fromCharCode(...bytes.subarray(i, i + step));
    return btoa(binary);
}
