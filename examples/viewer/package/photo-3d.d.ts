/** Position of the viewer, each value -1 to 1: (0, 0, 0) is the photo's viewpoint, 1 is the limit of the motion. */
export interface Reach {
    right: number;
    up: number;
    forward: number;
}

/** The state of one photo. */
export interface PhotoState {
    reach: Reach;
    /** Magnification, 1 to 6. */
    zoom: number;
    /** Angles around the pivot, in degrees; null without a photo. */
    angles: { horizontal: number; vertical: number } | null;
    /**
     * Current parallax between the nearest and the farthest surface, as a share of the photo's longer side; null if the file states no
     * limit.
     */
    motion: number | null;
    /** Opacity of the photo: 1 on a screen; in a headset it falls from 1 to 0 when the head leaves the photo's range. */
    visibility: number;
    isSwaying: boolean;
    /** Whether the next frame draws the photo. */
    isMoving: boolean;
    isInHeadset: boolean;
    /** Positions of the eyes relative to the photo's camera, in a headset; else empty. */
    eyes: number[][];
}

/** Counts of the work for all photos of a page, and of the objects in graphics memory. */
export interface Statistics {
    /** WebGL contexts made so far; more than one only after a context was lost. */
    contexts: number;
    frames: number;
    /** Draw calls. */
    drawings: number;
    geometries: number;
    textures: number;
    /** Photos in memory. */
    photos: number;
}

/** `<photo-3d>`: a 3D photo. Fires `load`, `error` (an ErrorEvent) and `share` (cancelable). */
export class Photo3D extends HTMLElement {
    // null removes the attribute. An absent attribute reads as an empty text.
    get src(): string;
    set src(value: string | null);
    get poster(): string;
    set poster(value: string | null);
    get alt(): string;
    set alt(value: string | null);
    get caption(): string;
    set caption(value: string | null);
    get fit(): string;
    set fit(value: string | null);
    get loading(): string;
    set loading(value: string | null);
    /** Whether the photo fills the screen. */
    readonly isAlone: boolean;
    /** Whether the 3D photo has replaced its poster. */
    readonly complete: boolean;
    readonly canvas: HTMLCanvasElement;
    /** Shows a GLB file from memory. Call clear() before you discard the element, to free the photo. Rejects if it can't be shown, with an AbortError if another photo replaces it first. */
    show(bytes: ArrayBuffer | Uint8Array): Promise<void>;
    /** Removes the photo, and shows the poster. Loads the photo of `src`, if there is one. */
    clear(): void;
    /** Shows a message over the photo; an empty one removes it. */
    report(text: string): void;
    /** Returns to the photo's viewpoint, without magnification. */
    reset(): void;
    /** Starts the sway again. */
    sway(): void;
    /** Moves the viewer. Missing values are 0. */
    lookFrom(reach: Partial<Reach>): void;
    enterFullscreen(): Promise<void>;
    exitFullscreen(): Promise<void>;
    /** Shares the page's address, or copies it. In a frame without an address, only fires the event. */
    share(): Promise<void>;
    state(): PhotoState;
    /** Shows or hides the backdrop. Without it, the gaps of the mesh are visible. */
    setBackdrop(isVisible: boolean): void;
    static statistics(): Statistics;
}

declare global {
    interface HTMLElementTagNameMap {
        "photo-3d": Photo3D;
    }
}
