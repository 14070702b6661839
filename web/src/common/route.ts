/** Which page the address names; it stands after the `#`, so that the service needs to know one page only. */
export type Route =
  | { page: "assessment"; assessment: string | null; candidate: string | null }
  | { page: "recording" };

/** Reads an address; anything unknown is the page of the newest assessment. */
export function parseRoute(hash: string): Route {
  const parts = hash
    .replace(/^#?\/?/, "")
    .split("/")
    .map(decode);
  if (parts[0] === "recording") return { page: "recording" };
  const known = parts[0] === "assessments";
  return {
    page: "assessment",
    assessment: (known && parts[1]) || null,
    candidate: (known && parts[2]) || null,
  };
}

export function formatRoute(route: Route): string {
  if (route.page === "recording") return "#/recording";
  const parts = [route.assessment, route.candidate].filter((part) => part !== null);
  return ["#/assessments", ...parts.map(encodeURIComponent)].join("/");
}

function decode(part: string): string {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}
