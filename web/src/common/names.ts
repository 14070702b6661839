/** Names of joints and body parts in words. */
const JOINTS: Readonly<Record<string, string>> = {
  jL5S1: "Low back (L5–S1)",
  jL4L3: "Lumbar spine (L4–L3)",
  jL1T12: "Mid spine (L1–T12)",
  jT9T8: "Upper spine (T9–T8)",
  jT1C7: "Neck (T1–C7)",
  jC1Head: "Head",
  C7Shoulder: "shoulder girdle",
  Shoulder: "shoulder",
  Elbow: "elbow",
  Wrist: "wrist",
  Hip: "hip",
  Knee: "knee",
  Ankle: "ankle",
  BallFoot: "forefoot",
};

const capital = (text: string) => text.charAt(0).toUpperCase() + text.slice(1);

/** `jRightShoulder` becomes "Right shoulder"; names of other kinds are only spaced out. */
export function jointWords(name: string): string {
  const whole = JOINTS[name];
  if (whole !== undefined) return whole;
  const sided = /^j(Right|Left)(\w+)$/.exec(name);
  const part = sided && JOINTS[sided[2]!];
  if (sided && part) return `${sided[1]} ${part}`;
  return words(name);
}

/** Makes an identifier readable: `upper_arm`, `RightUpperArm` become "Upper arm", "Right upper arm". */
export function words(name: string): string {
  const spaced = name
    .replace(/[_-]+/g, " ")
    .replace(/([a-z])([A-Z])/g, (_, a: string, b: string) => `${a} ${b.toLowerCase()}`)
    .trim();
  return capital(spaced.replace(/\b(rula|reba)\b/gi, (score) => score.toUpperCase()));
}

const METHODS: Readonly<Record<string, string>> = {
  "mi-nsgp": "MI-NsGP",
  "cov-ik": "Cov-IK",
  "minimum-norm": "Minimum norm",
  "min-norm": "Minimum norm",
};

export const methodWords = (name: string): string =>
  METHODS[name.toLowerCase().replaceAll("_", "-")] ?? words(name);

/** Orders joints from the hand inwards to the low back, others after them. */
const ORDER = ["Wrist", "Elbow", "RightShoulder", "LeftShoulder", "C7Shoulder", "T9T8", "L1T12"];
ORDER.push("L4L3", "L5S1", "T1C7", "C1Head", "Hip", "Knee", "Ankle", "BallFoot");

export function compareJoints(a: string, b: string): number {
  const place = (name: string) => {
    const found = ORDER.findIndex((part) => name.includes(part));
    return found < 0 ? ORDER.length : found;
  };
  return place(a) - place(b) || a.localeCompare(b);
}

/** Lowers the first letter, to stand inside a sentence; abbreviations keep theirs. */
export const inSentence = (text: string): string =>
  /^[A-Z]{2}/.test(text) ? text : text.charAt(0).toLowerCase() + text.slice(1);
