// Saves and shares files, and records a canvas.

/** @param {Blob} content @param {string} name */
export function save(content, name) {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(content);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60_000); // the browser may still be reading the file
}

/** Whether the system can share this file. @param {File} file */
export const canShare = (file) => navigator.canShare?.({ files: [file] }) === true;

/** @param {File} file */
export async function share(file) {
    try {
        await navigator.share({ files: [file], title: file.name });
    } catch (failure) {
        if (failure.name !== "AbortError") throw failure; // the user closed the dialog
    }
}

const videoTypes = ["video/mp4;codecs=avc1.640028", "video/mp4", "video/webm;codecs=vp9", "video/webm"];

/** Type of the videos that this browser records; undefined if it records none. */
export const videoType = () => globalThis.MediaRecorder && videoTypes.find((type) => MediaRecorder.isTypeSupported(type));

/**
 * Records a canvas.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {number} seconds
 * @param {(fraction: number) => void} onProgress
 * @returns {Promise<Blob>}
 */
export async function record(canvas, seconds, onProgress) {
    const stream = canvas.captureStream(30);
    const recorder = new MediaRecorder(stream, { mimeType: videoType(), videoBitsPerSecond: 8_000_000 });
    const parts = [];
    recorder.ondataavailable = ({ data }) => parts.push(data);
    const isDone = new Promise((resolve, reject) => {
        recorder.onstop = resolve;
        recorder.onerror = (event) => reject(event.error ?? new Error("The video could not be recorded."));
    });
    recorder.start(1000);
    const size = `${canvas.width} x ${canvas.height}`;
    const start = performance.now();
    const timer = setInterval(() => {
        const fraction = (performance.now() - start) / 1000 / seconds;
        onProgress(Math.min(fraction, 1));
        const isWhole = `${canvas.width} x ${canvas.height}` === size; // players refuse videos whose size changes
        if (!isWhole) recorder.onerror({ error: new Error("The size of the window changed during the recording. Please record again.") });
        if ((!isWhole || fraction >= 1) && recorder.state === "recording") recorder.stop();
    }, 100);
    try {
        await isDone;
    } finally {
        clearInterval(timer);
        for (const track of stream.getTracks()) track.stop();
    }
    return new Blob(parts, { type: recorder.mimeType });
}
