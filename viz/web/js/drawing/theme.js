// Light or dark: as the system, or as the user chose.
import * as store from "#core/store.js";

export const systemIsDark = matchMedia("(prefers-color-scheme: dark)");

export const isDark = () => (store.theme.value === "system" ? systemIsDark.matches : store.theme.value === "dark");

export function applyTheme() {
  if (store.theme.value === "system") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = store.theme.value;
  store.save("theme", store.theme.value);
}
