// Words for screen readers: what the last change has led to, once there is a pause.

// Milliseconds.
const pause = 500;
// How often it is asked for words that are not there yet.
const mostAsked = 40;

export class Announcer {
  #element;
  #timer;

  /** `element` is a live region of the page. */
  constructor(element) {
    this.#element = element;
  }

  /** Says what `textOf()` returns when nothing else is to be said for a moment; it is asked again while that is undefined. */
  say(textOf, asked = 0) {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => {
      const text = textOf();
      if (text !== undefined) this.#element.textContent = text;
      else if (asked < mostAsked) this.say(textOf, asked + 1);
    }, pause);
  }
}
