// What the browser keeps for the user between two visits. A page in a file has no storage: it forgets.

export function saved<T>(name: string, fallback: T): T {
  try {
    return JSON.parse(localStorage.getItem(`smachpy.${name}`) ?? "null") ?? fallback;
  } catch {
    return fallback;
  }
}

export function save(name: string, value: unknown) {
  try {
    localStorage.setItem(`smachpy.${name}`, JSON.stringify(value));
  } catch {
    // without storage it is forgotten
  }
}
