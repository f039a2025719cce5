// Questions to the server that gave this page.

/** The answer as JSON; an error with the server's words where it has none. */
export async function ask(path, parameters = {}, signal = undefined) {
  const words = new URLSearchParams(Object.entries(parameters).filter(([, value]) => value !== "" && value !== null)).toString();
  const answer = await fetch(words ? `${path}?${words}` : path, { signal });
  if (!answer.ok) throw new Error((await answer.text()).trim());
  return answer.json();
}

/** The answer, or null where there is none. */
export const askIfAny = (path, parameters) => ask(path, parameters).catch(() => null);
