/** What a dialog fetches: nothing yet, the answer, or why there is none. */
import { useCallback, useEffect, useRef, useState } from "preact/hooks";
import { describeError } from "../state/notices";

export interface Loaded<T> {
  value: T | null;
  /** One line for a person; the last value stays where a later call failed. */
  error: string | null;
  loading: boolean;
  reload: () => Promise<void>;
  /** Show what a change answered with, without asking again. */
  show: (value: T) => void;
}

/** Fetch when shown, and again when `reload` is called or a key changes; an answer that was overtaken is dropped. */
export function useLoaded<T>(fetchIt: () => Promise<T>, keys: unknown[] = []): Loaded<T> {
  const [value, setValue] = useState<T | null>(null);
  const [error, setError] = useState<string | null>(null);
  const [loading, setLoading] = useState(true);
  const asked = useRef(0);

  const reload = useCallback(async () => {
    const number = (asked.current += 1);
    setLoading(true);
    try {
      const answer = await fetchIt();
      if (number !== asked.current) return;
      setValue(answer);
      setError(null);
    } catch (thrown) {
      if (number === asked.current) setError(describeError(thrown));
    }
    if (number === asked.current) setLoading(false);
  }, keys);

  useEffect(() => {
    void reload();
    return () => {
      asked.current += 1;
    };
  }, [reload]);

  const show = useCallback((next: T) => {
    asked.current += 1;
    setValue(next);
    setError(null);
    setLoading(false);
  }, []);

  return { value, error, loading, reload, show };
}
