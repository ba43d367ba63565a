// The converter as a function from a file to a 3D photo. The work is done in a Worker (worker.js).

import { readAsset } from "./assets.js";

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

export class Converter {
    constructor() {
        this.pending = new Map();
        this.lastId = 0;
        /** Settles when the networks are loaded. @type {Promise<{milliseconds: number}>} */
        this.ready = this.start();
        /** Settles when the browser has seen all of the code, or a photo has come first. @type {Promise<{milliseconds: number}>} */
        this.warm = new Promise((resolve) => (this.whenWarm = resolve));
        this.ready.catch(() => {}); // convert() reports it
    }

    async start() {
        const [program, wasm, depth, inpainting] = await Promise.all(
            ["worker.js", "converter.wasm", "depth.safetensors", "inpainting.halves"].map(readAsset),
        );
        const address = URL.createObjectURL(new Blob([program], { type: "text/javascript" }));
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
        this.worker.postMessage({ load: { wasm, depth, inpainting } }, [wasm.buffer, depth.buffer, inpainting.buffer]);
        return ready.finally(() => URL.revokeObjectURL(address));
    }

    receive({ id, stage, fraction, result, failure }) {
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
     * @param {boolean} [isExact]  the GLB's texture is a PNG
     * @returns {Promise<Photo3d>}
     */
    async convert(bytes, name, onProgress, isExact = false) {
        await this.ready;
        return new Promise((resolve, reject) => {
            const id = ++this.lastId;
            this.pending.set(id, { resolve, reject, onProgress });
            this.worker.postMessage({ convert: { bytes, name, isExact }, id });
        });
    }
}
