// Keys of a whole page, wherever the focus is.
let pressed = null; // by the pointer, last; null once Tab has moved the focus

document.addEventListener("pointerdown", ({ target }) => { pressed = target; }, true);
document.addEventListener("keydown", (event) => {
  if (event.code === "Tab") pressed = null;
  // or the browser undoes what was typed last, too
  if (event.ctrlKey && /[zy]/.test(event.key) && !event.target.matches("input, textarea")) event.preventDefault();
});

// A list from which the pointer has chosen lets go of the keys, which are the page's again. Quasar gives it the focus
// back, on a slow machine much later, when something else may have been clicked.
const release = () => {
  const list = document.activeElement;
  if (!list.matches(".q-select__focus-target") || list.getAttribute("aria-expanded") === "true") return;
  if (pressed && !list.closest(".q-select").contains(pressed)) list.blur();
};
document.addEventListener("focusin", release);
document.addEventListener("click", () => setTimeout(release)); // once the list is closed

// Press the page's blue button: the last that is there, as Use comes after Find; one in focus hears Enter itself.
export function pressBlue() {
  const here = document.activeElement, card = here.closest(".card");
  const blue = [...document.querySelectorAll(".main .q-btn--unelevated.bg-primary:not(.disabled)")];
  const seen = blue.filter((each) => each.checkVisibility()), near = seen.filter((each) => card?.contains(each));
  const cards = new Set(seen.map((each) => each.closest(".card")));
  const button = near.at(-1) || (cards.size === 1 && seen.at(-1));
  if (button && here.tagName !== "BUTTON") button.click();
}

// A decimal comma is a point: number fields of an English browser leave it out, and 47,5 becomes 475.
document.addEventListener("beforeinput", (event) => {
  const text = event.data ?? event.dataTransfer?.getData("text/plain");
  if (event.target.type !== "number" || !text?.includes(",")) return;
  event.preventDefault();
  const number = text.includes(".") ? text.replaceAll(",", "") : text.replace(",", ".");
  document.execCommand("insertText", false, number);
});
