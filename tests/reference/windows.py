"""What windows of time leave of a grid of steps, by looking at every step and every stay of one step."""


def blocks_step(window, k):
    """Whether step k is forbidden: strictly inside an open window, or the instant of one that has no length."""
    start, end = window
    return k == start if start == end else start < k < end


def blocks_stay(window, k):
    """Whether staying from step k to the next is forbidden."""
    start, end = window
    return k <= start <= k + 1 if start == end else start < k + 1 and end > k


def stays(windows, last):
    """Longest runs (lo, hi) of steps up to `last` on which to stay is allowed, single steps among them."""
    out, run = [], None
    for k in range(last + 1):
        if any(blocks_step(w, k) for w in windows):
            run = None
        elif run is not None and not any(blocks_stay(w, k - 1) for w in windows):
            run[1] = k
        else:
            run = [k, k]
            out.append(run)
    return [tuple(run) for run in out]
