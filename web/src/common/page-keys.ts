import type { Playback } from "./playback";

const STEP_S = 0.05;
const LEAP_S = 0.5;

/** Elements that use the space bar and the arrows themselves. */
const OWN_KEYS = "input, textarea, select, dialog";

/**
 * The keys of the page: space or k plays, the left and right arrows step (with shift: leap), Home
 * and End go to the ends. Controls keep the keys they need.
 *
 * @returns Whether the key was used.
 */
export function handleKey(event: KeyboardEvent, playback: Playback): boolean {
  if (event.ctrlKey || event.metaKey || event.altKey) return false;
  const target = event.composedPath()[0];
  const element = target instanceof Element ? target : null;
  if (element?.closest(OWN_KEYS)) return false;
  if (event.key === " " && element?.closest("button, a")) return false;
  const leap = event.shiftKey ? LEAP_S : STEP_S;
  switch (event.key) {
    case " ":
    case "k":
      playback.toggle();
      break;
    case "ArrowLeft":
      playback.pause();
      playback.seek(playback.time - leap);
      break;
    case "ArrowRight":
      playback.pause();
      playback.seek(playback.time + leap);
      break;
    case "Home":
      playback.seek(playback.start);
      break;
    case "End":
      playback.seek(playback.end);
      break;
    default:
      return false;
  }
  event.preventDefault();
  return true;
}
