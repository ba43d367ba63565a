// The files that the page needs besides itself: in the page as base64 text, or on the server beside it. Both are compressed.

/** Reads a file. @param {string} name @returns {Promise<Uint8Array>} */
export async function readAsset(name) {
    const inPage = document.getElementById(`asset ${name}`);
    const packed = inPage ? fromBase64(inPage.textContent) : await download(`${name}.gz`);
    const unpacked = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Uint8Array(await new Response(unpacked).arrayBuffer());
}

async function download(name) {
    const response = await fetch(name);
    if (!response.ok) throw new Error(`The page is incomplete: ${name} is missing.`);
    return response.arrayBuffer();
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
    const step = 0x8000; // arguments of one call
    for (let i = 0; i < bytes.length; i += step) binary += String.fromCharCode(...bytes.subarray(i, i + step));
    return btoa(binary);
}
