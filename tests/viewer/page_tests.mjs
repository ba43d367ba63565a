// Runs tests of pages one after the other, prints a line for each, and counts them. The tests in ../web also use it.

import assert from "node:assert/strict";

export class PageTests {
    passed = 0;
    failed = 0;

    /** @param {string} [only]  runs only tests whose name contains this word */
    constructor(only) {
        this.only = only;
    }

    /**
     * Opens a page, runs a test on it, and checks that the page has no errors.
     *
     * @template {{errors: string[], close(): Promise<void>}} Page
     * @param {string} fact  the tested fact, which is the name of the test
     * @param {() => Promise<Page>} open
     * @param {(page: Page) => Promise<void>} check
     * @param {(page: Page) => boolean} isKept  whether the page stays open for other tests
     */
    async run(fact, open, check, isKept = () => false) {
        if (this.only && !fact.includes(this.only)) return;
        const start = performance.now();
        let page;
        try {
            page = await open();
            await check(page);
            assert.deepEqual(page.errors, [], "no console errors and no requests");
            this.passed += 1;
            console.log(`passed: ${fact} (${Math.round(performance.now() - start)} ms)`);
        } catch (failure) {
            this.failed += 1;
            console.log(`FAILED: ${fact}\n${failure.stack}\n${page?.errors.join("\n") ?? ""}`);
        }
        if (page && !isKept(page)) await page.close();
    }

    /** Prints the counts and ends the process, with code 0 if a test ran and none failed. */
    end() {
        console.log(`${this.passed} passed, ${this.failed} failed`);
        process.exit(this.failed === 0 && this.passed > 0 ? 0 : 1);
    }
}
