// Templates, and small components that several panels use.

import type { ComponentChildren } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { store } from "#core/store.ts";
import { shorten } from "#core/text.ts";
import type { Page } from "#drawing/page.ts";

export const Section = ({
  title,
  count,
  children,
}: {
  title: string;
  count?: number | null;
  children?: ComponentChildren;
}) => (
  <section>
    <h2>
      {title} {count != null && <span class="number">{count}</span>}
    </h2>
    {children}
  </section>
);

/** The name of a state as a link to it. */
export const StateLink = ({ path, page, tabindex }: { path: string; page: Page; tabindex?: number }) => (
  <button class="link" tabindex={tabindex} title={shorten(path, 400)} onClick={() => page.goTo(path)}>
    {store.data.nameOf(path)}
  </button>
);

/** A button below a shortened list that shows more of it. */
export const More = ({ left, onMore }: { left: number; onMore: () => void }) =>
  left > 0 ? (
    <button class="small" onClick={onMore}>
      and {left.toLocaleString("en")} more
    </button>
  ) : null;

/** An outcome or status in the colours of its class. */
export const Pill = ({ kind, children }: { kind: string; children?: ComponentChildren }) => (
  <span class={`pill-text ${kind}`}>{children}</span>
);

/** The value of a field. */
export const fieldValue = (e: Event) => (e.target as HTMLInputElement).value;

const FOR_THE_PAGE = ["Escape", "?"]; // keys that close a dialog

/** A dialog over the page. The focus moves into it, stays there, and returns to where it was. */
export function Dialog({
  label,
  class: name = "",
  onClose,
  children,
}: {
  label: string;
  class?: string;
  onClose: () => void;
  children?: ComponentChildren;
}) {
  const box = useRef<HTMLDialogElement | null>(null);
  useEffect(() => {
    const dialog = box.current;
    const before = document.activeElement;
    dialog?.showModal();
    return () => {
      dialog?.close();
      if (before instanceof HTMLElement) before.focus();
    };
  }, []);
  const onCancel = (e: Event) => {
    e.preventDefault();
    onClose();
  };
  const onClick = (e: MouseEvent) => e.target === e.currentTarget && onClose(); // beside it
  const onKeyDown = (e: KeyboardEvent) => FOR_THE_PAGE.includes(e.key) || e.stopPropagation();
  return (
    <dialog
      class={`card ${name}`}
      aria-label={label}
      ref={box}
      onCancel={onCancel}
      onClick={onClick}
      onKeyDown={onKeyDown}
    >
      {children}
    </dialog>
  );
}
