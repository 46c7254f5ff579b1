"""What is cut off on a page in the browser, and which of its controls lie over each other."""

SCRIPT = """() => {
    const CONTROLS = "a[href], button, input, .q-field, [role=switch], [role=checkbox], canvas";
    const name = (each) => each.outerHTML.slice(0, 160);
    const dialog = document.querySelector("[role=dialog]"); // the rest lies below it
    const visible = [...(dialog ? dialog.querySelectorAll("*") : document.querySelectorAll("html, body *"))].filter(
        (each) => each.checkVisibility({ opacityProperty: true, visibilityProperty: true })
    );
    const isClipping = (each) => each.tagName === "INPUT" || /hidden|clip/.test(getComputedStyle(each).overflowX);
    const hasText = (each) =>
        each.tagName === "INPUT"
            ? each.value !== ""
            : [...each.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && node.data.trim() !== "");
    const spills = (each) =>
        each.scrollWidth > each.clientWidth + 1 || each.scrollHeight > each.clientHeight + 1;
    const isCut = (each) =>
        (each.matches("html, .body, .main.still") || (isClipping(each) && hasText(each))) && spills(each);
    const seenArea = (each) => { // without what its ancestors hide, or have scrolled away
        let { left, top, right, bottom } = each.getBoundingClientRect();
        for (let at = each.parentElement; at; at = at.parentElement) {
            if (getComputedStyle(at).overflowX === "visible") continue;
            const box = at.getBoundingClientRect();
            [left, top] = [Math.max(left, box.left), Math.max(top, box.top)];
            [right, bottom] = [Math.min(right, box.right), Math.min(bottom, box.bottom)];
        }
        return { each, left, top, right, bottom };
    };
    const doOverlap = (a, b) =>
        !a.each.contains(b.each) && !b.each.contains(a.each) &&
        Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1 &&
        Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1;
    const areas = visible.filter((each) => each.matches(CONTROLS)).map(seenArea);
    const overlaps = areas.flatMap((a, k) =>
        areas.slice(k + 1).filter((b) => doOverlap(a, b)).map((b) => `${name(a.each)} lies over ${name(b.each)}`)
    );
    return [...visible.filter(isCut).map((each) => `cut: ${name(each)}`), ...overlaps];
}"""


def layout_faults(page) -> list[str]:
    """Return them, by the beginnings of their elements."""
    return page.evaluate(SCRIPT)
