/** How a video follows the clock: what to do with it now, given where it is. */

/** Pictures per second where the file's own number is not known. */
const USUAL_RATE = 25;
/** ms between two corrections while playing: a seek takes time, and one after the other would show nothing. */
const REST = 300;
/** s; no seek is expected to take longer. */
const LONGEST_SEEK = 0.5;

export interface ClockState {
  /** Time in the video, s. */
  seconds: number;
  playing: boolean;
  speed: number;
  /** Whether it jumped since the video was last put in place. */
  jumped: boolean;
}

export interface VideoState {
  /** s */
  current: number;
  /** s; NaN while it is not known. */
  duration: number;
  /** Pictures per second; null where unknown. */
  rate: number | null;
  seeking: boolean;
  /** ms since the last seek was asked for. */
  sinceSeek: number;
  /** s that the last seek took. */
  seekTook: number;
}

export interface VideoStep {
  play: boolean;
  /** Where to put it, s; null to leave it. */
  seek: number | null;
  /** Whether there is a picture of this moment. */
  hasPicture: boolean;
}

/**
 * Return what to do.
 *
 * At rest the video shows the very picture of the moment: its middle, since a border belongs to either. While playing
 * it runs by itself at the clock's speed, and is put right where it is off by more than one picture.
 */
export function followClock(clock: ClockState, video: VideoState): VideoStep {
  const picture = 1 / (video.rate !== null && video.rate > 0 ? video.rate : USUAL_RATE);
  const isKnown = Number.isFinite(video.duration);
  if (clock.seconds < 0 || (isKnown && clock.seconds >= video.duration)) {
    return { play: false, seek: null, hasPicture: false };
  }
  // Where it goes next is decided when it has arrived.
  if (video.seeking) return { play: clock.playing, seek: null, hasPicture: true };
  if (!clock.playing) {
    const middle = (Math.floor(clock.seconds / picture + 1e-6) + 0.5) * picture;
    const target = isKnown ? Math.min(middle, video.duration) : middle;
    const isThere = Math.abs(video.current - target) < picture / 4;
    return { play: false, seek: isThere ? null : target, hasPicture: true };
  }
  const isOff = Math.abs(video.current - clock.seconds) > picture * Math.max(1, clock.speed);
  if (!isOff || (!clock.jumped && video.sinceSeek < REST)) return { play: true, seek: null, hasPicture: true };
  // The clock goes on while the video seeks.
  const ahead = Math.min(video.seekTook, LONGEST_SEEK) * clock.speed;
  const target = clock.seconds + ahead;
  return { play: true, seek: isKnown ? Math.min(target, video.duration) : target, hasPicture: true };
}
