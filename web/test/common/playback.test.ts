import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";

import { Playback } from "../../src/common/playback";

let frames: ((now: number) => void)[] = [];
const advance = (now: number) => frames.splice(0).forEach((frame) => frame(now));

beforeEach(() => {
  frames = [];
  vi.stubGlobal("requestAnimationFrame", (frame: (now: number) => void) => frames.push(frame));
  vi.stubGlobal("cancelAnimationFrame", () => (frames = []));
  vi.spyOn(performance, "now").mockReturnValue(0);
});
afterEach(() => vi.unstubAllGlobals());

describe("Playback", () => {
  it("runs with the wall clock times its rate and stops at the end", () => {
    const clock = new Playback();
    clock.load(0, 0.3);
    clock.rate = 0.5;
    clock.play();
    advance(100);
    expect(clock.time).toBeCloseTo(0.05);
    for (let now = 200; now <= 800; now += 100) advance(now);
    expect(clock.time).toBe(0.3);
    expect(clock.playing).toBe(false);
  });

  it("starts over when played at its end", () => {
    const clock = new Playback();
    clock.load(1, 2);
    clock.seek(2);
    clock.play();
    expect(clock.time).toBe(1);
    clock.pause();
    expect(frames).toEqual([]);
  });

  it("keeps its time inside the range, and across ranges where it can", () => {
    const clock = new Playback();
    clock.load(0, 4);
    clock.seek(99);
    expect(clock.time).toBe(4);
    clock.seek(Number.NaN);
    expect(clock.time).toBe(4);
    clock.load(0, 3);
    expect(clock.time).toBe(3);
    clock.seek(2);
    clock.load(0, 5);
    expect(clock.time).toBe(2);
  });

  it("does not leap over the time a tab was hidden", () => {
    const clock = new Playback();
    clock.load(0, 60);
    clock.play();
    advance(30_000);
    expect(clock.time).toBeLessThanOrEqual(0.25);
  });

  it("tells of every change", () => {
    const clock = new Playback();
    let changes = 0;
    clock.addEventListener("change", () => changes++);
    clock.load(0, 1);
    clock.seek(0.5);
    clock.toggle();
    clock.toggle();
    expect(changes).toBe(4);
  });
});
