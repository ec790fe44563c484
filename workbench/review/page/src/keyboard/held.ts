/** Commands whose keys are held down now, by id. */
export const held = new Set<string>();
