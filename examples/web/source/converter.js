// The converter as a function from a file to a 3D photo. A Worker does the work (worker.js).

import { isOneFile, readAsset } from "./assets.js";

/**
 * @typedef {object} Photo3d
 * @property {Uint8Array} glb
 * @property {Uint8Array} poster  a small JPEG of the photo
 * @property {number} width  of the photo, in pixels
 * @property {number} height
 * @property {boolean} isPastFrame  surfaces continue past the photo's border
 * @property {string} depthSource  description of the depth in the file, or the reason why it was not used; else empty
 * @property {Record<string, number>} stages  milliseconds of each stage
 * @property {number} heap  memory of the converter, in bytes
 */

/** Threads need shared memory, which browsers allow only on pages that the server isolates. */
const canHaveThreads = () => !isOneFile() && globalThis.crossOriginIsolated && navigator.hardwareConcurrency > 1;

/** Whether a file is HEIC: its first bytes list at least one brand of HEIC and no brand of AVIF. */
function isHeic(bytes) {
    const brands = String.fromCharCode(...bytes.subarray(4, 40));
    return /^ftyp.*(hei[cxms]|hevc|mif1|msf1)/s.test(brands) && !/avi[fs]/.test(brands);
}

/**
 * Reads a HEIC photo with its depth in a Worker. The Worker ends afterwards, which frees its memory. Loads the reader from the server.
 *
 * @returns {Promise<{decoded: import("./heic.js").DecodedPhoto | null, refusal: string}>}
 */
async function readHeic(bytes, name) {
    const nothing = { decoded: null, refusal: "" };
    if (isOneFile() || !isHeic(bytes)) return nothing;
    const files = await Promise.all(["heic.js", "heic.wasm"].map(readAsset)).catch(() => null);
    if (!files) return nothing; // the browser itself may be able to read the photo
    const [script, wasm] = files;
    const address = URL.createObjectURL(new Blob([script], { type: "text/javascript" }));
    const worker = new Worker(address);
    return new Promise((resolve) => {
        worker.onerror = (event) => resolve({ decoded: null, refusal: event.message || "The HEIC reader can't start in this browser." });
        worker.onmessage = ({ data }) => resolve({ decoded: data.decoded ?? null, refusal: data.failure ?? "" });
        worker.postMessage({ wasm, bytes, name });
    }).finally(() => {
        worker.terminate();
        URL.revokeObjectURL(address);
    });
}

export class Converter {
    constructor() {
        this.pending = new Map();
        this.lastId = 0;
        /**
         * Settles when the networks are loaded. Null after a failure; the next photo starts another Worker.
         *
         * @type {Promise<{milliseconds: number, threads: number}> | null}
         */
        this.ready = this.begin();
        /** Settles after the code has warmed up, or earlier if a photo arrives. @type {Promise<{milliseconds: number}>} */
        this.warm = new Promise((resolve) => (this.whenWarm = resolve));
    }

    begin() {
        const ready = this.start();
        ready.catch(() => {
            if (this.ready === ready) this.ready = null; // convert() reports the error
        });
        return ready;
    }

    async start() {
        const weights = Promise.all(["depth.safetensors", "inpainting.halves", "silhouettes.halves"].map(readAsset));
        if (!canHaveThreads()) return this.startWith("converter", await weights);
        return this.startWith("converter_threads", await weights).catch(async () => {
            this.worker?.terminate();
            return this.startWith("converter", await weights);
        });
    }

    /**
     * Starts the Worker.
     *
     * @param {"converter" | "converter_threads"} program
     * @param {Uint8Array[]} weights  of all networks, in the order of worker.js
     */
    async startWith(program, weights) {
        const [loader, script, wasm] = await Promise.all([`${program}.js`, "worker.js", `${program}.wasm`].map(readAsset));
        const threads = program === "converter" ? null : { loader, worker: await readAsset(`${program}.worker.js`) };
        const address = URL.createObjectURL(new Blob([loader, "\n", script], { type: "text/javascript" }));
        this.worker = new Worker(address);
        const ready = new Promise((resolve, reject) => {
            this.worker.onerror = (event) => reject(new Error(event.message || "The converter can't start in this browser."));
            this.worker.onmessage = ({ data }) => {
                if (data.ready) resolve(data.ready);
                else if (data.warm) this.whenWarm(data.warm);
                else if (data.id === null) reject(new Error(data.failure));
                else this.receive(data);
            };
        });
        this.worker.postMessage({ load: { wasm, weights, threads } });
        await ready.finally(() => URL.revokeObjectURL(address));
        this.worker.onerror = (event) => this.broke(event.message);
        return ready;
    }

    /** Ends a Worker that threw an error outside of a conversion or is broken, and rejects all pending conversions. */
    broke(message) {
        this.worker.terminate();
        this.ready = null;
        for (const job of this.pending.values()) job.reject(new Error(message || "The converter failed."));
        this.pending.clear();
    }

    receive({ id, stage, fraction, result, failure, isBroken }) {
        if (isBroken) return this.broke(failure);
        const job = this.pending.get(id);
        if (stage) {
            job.onProgress(stage, fraction);
            return;
        }
        this.pending.delete(id);
        if (result) job.resolve(result);
        else job.reject(new Error(failure));
    }

    /**
     * Converts a photo. Rejects with the program's message if the file can't be used.
     *
     * @param {Uint8Array} bytes  of the file
     * @param {string} name  of the file
     * @param {(stage: string, fraction: number) => void} onProgress
     * @param {boolean} [isExact]  whether the GLB's texture is a PNG instead of a JPEG
     * @returns {Promise<Photo3d>}
     */
    async convert(bytes, name, onProgress, isExact = false) {
        await (this.ready ??= this.begin());
        onProgress("reading photo", 0);
        const { decoded, refusal } = await readHeic(bytes, name);
        await (this.ready ??= this.begin());
        return new Promise((resolve, reject) => {
            const id = ++this.lastId;
            this.pending.set(id, { resolve, reject, onProgress });
            const moved = decoded ? [decoded.color.buffer, ...(decoded.depth ? [decoded.depth.disparity.buffer] : [])] : [];
            this.worker.postMessage({ convert: { bytes, name, isExact, decoded, refusal }, id }, moved);
        });
    }
}
