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

const videoTypes = ["video/mp4;codecs=avc1.640033", "video/mp4", "video/webm;codecs=vp9", "video/webm"];

/** Type of the videos that this browser records; undefined if it records none. */
export const videoType = () => globalThis.MediaRecorder && videoTypes.find((type) => MediaRecorder.isTypeSupported(type));

/**
 * Returns a canvas with even sides, as H.264 needs them, that follows another one until `stop` is called.
 *
 * @param {HTMLCanvasElement} canvas
 */
function evenCopy(canvas) {
    const copy = document.createElement("canvas");
    [copy.width, copy.height] = [canvas.width, canvas.height].map((side) => Math.max(side - (side % 2), 2));
    const pen = copy.getContext("2d");
    let request = 0;
    const draw = () => {
        pen.drawImage(canvas, 0, 0);
        request = requestAnimationFrame(draw);
    };
    draw();
    return { copy, stop: () => cancelAnimationFrame(request) };
}

/**
 * Records a canvas.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {number} seconds
 * @param {(fraction: number) => void} onProgress
 * @returns {Promise<Blob>}
 */
export async function record(canvas, seconds, onProgress) {
    const isEven = canvas.width % 2 === 0 && canvas.height % 2 === 0;
    const { copy, stop } = isEven ? { copy: canvas, stop: () => {} } : evenCopy(canvas);
    const stream = copy.captureStream(30);
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
    const end = (problem) => {
        if (problem) recorder.onerror({ error: new Error(`${problem} during the recording. Please record again.`) });
        if (recorder.state === "recording") recorder.stop();
    };
    const timer = setInterval(() => {
        const fraction = (performance.now() - start) / 1000 / seconds;
        onProgress(Math.min(fraction, 1));
        if (`${canvas.width} x ${canvas.height}` !== size) end("The size of the window changed"); // players refuse such videos
        else if (fraction >= 1) end();
    }, 100);
    const visibilityChanged = () => document.hidden && end("The page was hidden"); // browsers don't draw hidden pages
    document.addEventListener("visibilitychange", visibilityChanged);
    visibilityChanged();
    try {
        await isDone;
    } finally {
        clearInterval(timer);
        stop();
        document.removeEventListener("visibilitychange", visibilityChanged);
        for (const track of stream.getTracks()) track.stop();
    }
    return new Blob(parts, { type: recorder.mimeType });
}
