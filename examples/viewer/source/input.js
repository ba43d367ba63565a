// Mouse, fingers, wheel and keys, handed on to the motion.

/** @typedef {import("./motion.js").Motion} Motion */

/** Pixels of wheel from where the photo was taken to the end. */
const wheelPixels = 800;

/** A drag over this share of the frame's width goes as far as one should. */
const dragShare = 0.4;

const keySteps = {
    ArrowRight: (motion) => motion.step(0.2, 0),
    ArrowLeft: (motion) => motion.step(-0.2, 0),
    ArrowUp: (motion) => motion.step(0, 0.2),
    ArrowDown: (motion) => motion.step(0, -0.2),
    "+": (motion) => motion.scroll(0.2),
    "=": (motion) => motion.scroll(0.2), // plus, without shift
    "-": (motion) => motion.scroll(-0.2),
    PageDown: (motion) => motion.scroll(0.5),
    PageUp: (motion) => motion.scroll(-0.5),
    Home: (motion) => {
        motion.forget();
        motion.isIdle = false;
    },
};

/**
 * @param {HTMLElement} frame  where the photo is
 * @param {Motion} motion
 */
export function listenToInput(frame, motion) {
    let draggedFrom = null; // the last place of the finger that drags, in pixels

    // A mouse looks around by where it is. A finger drags the scene: what is near goes with it, so the viewer goes the other way.
    // With reduced motion the mouse drags too, since the picture must not move unless asked to.
    addEventListener("pointermove", (event) => {
        if (draggedFrom?.id === event.pointerId) {
            const scale = dragShare * frame.clientWidth;
            motion.drag((draggedFrom.x - event.clientX) / scale, (event.clientY - draggedFrom.y) / scale);
            draggedFrom = { id: event.pointerId, x: event.clientX, y: event.clientY };
        } else if (event.pointerType === "mouse" && !motion.isReduced()) {
            const { left, top, width, height } = frame.getBoundingClientRect();
            motion.hover((2 * (event.clientX - left)) / width - 1, 1 - (2 * (event.clientY - top)) / height);
        }
    });
    frame.addEventListener("pointerdown", (event) => {
        if (event.target.closest("button") || (event.pointerType === "mouse" && !motion.isReduced())) return;
        if (draggedFrom) return; // a second finger
        draggedFrom = { id: event.pointerId, x: event.clientX, y: event.clientY };
        frame.setPointerCapture(event.pointerId);
        motion.drag(0, 0); // the first touch ends the sway
    });
    const release = (event) => {
        if (draggedFrom?.id !== event.pointerId) return;
        draggedFrom = null;
        motion.release();
    };
    frame.addEventListener("pointerup", release);
    frame.addEventListener("pointercancel", release);

    // Scrolling down moves the viewer up and into the scene, as for a photo in a feed.
    addEventListener(
        "wheel",
        (event) => {
            event.preventDefault();
            const unit = [1, 40, 800][event.deltaMode]; // pixels, lines, pages
            motion.scroll((event.deltaY * unit) / wheelPixels);
        },
        { passive: false },
    );

    addEventListener("keydown", (event) => {
        if (event.altKey || event.ctrlKey || event.metaKey || !(event.key in keySteps)) return;
        event.preventDefault();
        keySteps[event.key](motion);
    });
}
