"""Steps and stays that time windows leave on a grid of steps, by testing each of them."""


def blocks_step(window, k):
    """Returns whether step k is forbidden: strictly inside an open window, or at a single instant."""
    start, end = window
    return k == start if start == end else start < k < end


def blocks_stay(window, k):
    """Returns whether staying from step k to the next is forbidden."""
    start, end = window
    return k <= start <= k + 1 if start == end else start < k + 1 and end > k


def stays(windows, last):
    """Returns the longest runs (lo, hi) of steps up to `last` in which staying is allowed, single steps included."""
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
