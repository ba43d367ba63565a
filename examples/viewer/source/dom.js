// Builds the element's tree without parsing HTML text, which a page may forbid (Trusted Types).

/**
 * @param {string} name  tag name
 * @param {Record<string, string | boolean>} attributes  true: attribute without a value; false: no attribute
 * @param {...(Node | string)} children
 */
export function make(name, attributes = {}, ...children) {
    const isPicture = name === "svg" || name === "path";
    const made = isPicture ? document.createElementNS("http://www.w3.org/2000/svg", name) : document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) if (value !== false) made.setAttribute(key, value === true ? "" : value);
    made.append(...children);
    return made;
}

const icons = {
    tilt: "M8 3h8v18H8zM4 8l-2 4 2 4M20 8l2 4-2 4",
    headset: "M3 8h18v9h-5l-2-3h-4l-2 3H3z",
    fit: "M3 7h18v10H3zM7 10v4M17 10v4",
    reset: "M4 12a8 8 0 1 0 3-6.2M4 4v5h5",
    share: "M12 15V3M8 7l4-4 4 4M5 12v8h14v-8",
    fullscreen: "M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5",
    leave: "M9 4v5H4M20 9h-5V4M15 20v-5h5M4 15h5v5",
};

/** @param {keyof typeof icons} name */
export function setIcon(button, name, label) {
    button.replaceChildren(make("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, make("path", { d: icons[name] })));
    button.setAttribute("aria-label", label);
    button.title = label;
}

/** @param {keyof typeof icons} name */
export function makeButton(name, label) {
    const button = make("button", { id: name, type: "button", part: `button ${name}`, "aria-labelledby": `${name} title`, hidden: true });
    setIcon(button, name, label);
    return button;
}

const helpText =
    "Arrow keys look around, plus and minus zoom, Home returns to the photo's viewpoint, F fills the screen.";

/** Builds the element's tree. @returns {Record<string, HTMLElement>} its parts by id */
export function makeParts(root) {
    const canvas = make("canvas", { id: "canvas", part: "canvas", hidden: true });
    const poster = make("img", { id: "poster", part: "poster", alt: "", draggable: "false", hidden: true });
    // Screen readers pass arrow keys to an application, but not to an image or a group.
    const role = { role: "application", "aria-roledescription": "interactive photo" };
    const photo = make("div", { id: "photo", part: "photo", ...role, tabindex: "0", "aria-label": "3D photo", "aria-describedby": "help" }, make("slot", { name: "poster" }, poster), canvas);
    const caption = make("div", { id: "caption", part: "caption", hidden: true });
    const hint = make("div", { id: "hint", part: "hint", "aria-hidden": "true", hidden: true });
    const message = make("div", { id: "message", part: "message", role: "status", hidden: true });
    const buttons = {
        tilt: makeButton("tilt", "Tilt to look around"),
        headset: makeButton("headset", "View in headset"),
        fit: makeButton("fit", "Show the whole photo"),
        reset: makeButton("reset", "Back to the photo's viewpoint"),
        share: makeButton("share", "Share"),
        fullscreen: makeButton("fullscreen", "Full screen"),
    };
    const controls = make("div", { id: "controls", part: "controls" }, ...Object.values(buttons));
    const help = make("div", { id: "help", hidden: true }, helpText);
    const title = make("div", { id: "title", hidden: true }, "3D photo"); // distinguishes the buttons of several photos
    const box = make("div", { id: "box", part: "box" }, photo, caption, hint, message, controls, help, title);
    root.append(box);
    return { box, photo, canvas, poster, caption, hint, message, controls, title, ...buttons };
}
