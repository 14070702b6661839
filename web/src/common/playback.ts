/**
 * The one clock of a page: the body, the plots and the scrubber all follow it.
 *
 * Fires `change` whenever the time, the range or the playing state changes.
 */
export class Playback extends EventTarget {
  time = 0;
  start = 0;
  end = 0;
  playing = false;
  rate = 1;
  #last = 0;
  #request = 0;

  get duration(): number {
    return this.end - this.start;
  }

  /** Sets the range; keeps the time where it still lies inside, so that candidates compare at one instant. */
  load(start: number, end: number): void {
    this.start = start;
    this.end = Math.max(start, end);
    this.time = Math.min(Math.max(this.time, this.start), this.end);
    this.#changed();
  }

  seek(time: number): void {
    if (!Number.isFinite(time)) return;
    this.time = Math.min(Math.max(time, this.start), this.end);
    this.#changed();
  }

  play(): void {
    if (this.playing || this.duration <= 0) return;
    if (this.time >= this.end) this.time = this.start;
    this.playing = true;
    this.#last = performance.now();
    this.#request = requestAnimationFrame(this.#tick);
    this.#changed();
  }

  pause(): void {
    if (!this.playing) return;
    this.playing = false;
    cancelAnimationFrame(this.#request);
    this.#changed();
  }

  toggle(): void {
    if (this.playing) this.pause();
    else this.play();
  }

  #tick = (now: number): void => {
    if (!this.playing) return;
    // A hidden tab gets no frames; do not leap over the gap when it comes back.
    const elapsed = Math.min(0.25, Math.max(0, (now - this.#last) / 1000));
    this.#last = now;
    this.time = Math.min(this.end, this.time + elapsed * this.rate);
    if (this.time >= this.end) this.playing = false;
    else this.#request = requestAnimationFrame(this.#tick);
    this.#changed();
  };

  #changed(): void {
    this.dispatchEvent(new Event("change"));
  }
}
