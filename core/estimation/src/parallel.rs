//! Work shared among threads.

use std::cell::Cell;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::ScopedJoinHandle;

/// Items handled at once by one thread of [`over_chunks`].
const CHUNK: usize = 128;

thread_local! {
    /// Whether this thread is one of several at work already.
    static BUSY: Cell<bool> = const { Cell::new(false) };
}

/// How many threads a computation that starts here may use. Asked of the system once: it takes as long as a small fit.
fn cores() -> usize {
    static CORES: OnceLock<usize> = OnceLock::new();
    if BUSY.get() {
        return 1;
    }
    *CORES.get_or_init(|| std::thread::available_parallelism().map_or(1, std::num::NonZero::get))
}

/// Does `work` for every item on as many threads as the machine has, and answers in the items' order. What `work` itself would
/// share among threads it does alone.
pub fn for_each<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let threads = cores().min(items.len());
    if threads < 2 {
        return items.iter().map(work).collect();
    }
    let next = AtomicUsize::new(0);
    let mut all: Vec<(usize, R)> = std::thread::scope(|scope| {
        // All threads are at work before the first is waited for.
        let handles: Vec<_> = (0..threads).map(|_| scope.spawn(|| taken(items, &next, &work))).collect();
        handles.into_iter().flat_map(joined).collect()
    });
    all.sort_by_key(|(index, _)| *index);
    all.into_iter().map(|(_, answer)| answer).collect()
}

/// Does one item after another until none is left, with other threads that do the same: items take very different times, so that
/// equal shares given out beforehand would leave threads idle.
fn taken<T, R>(items: &[T], next: &AtomicUsize, work: &impl Fn(&T) -> R) -> Vec<(usize, R)> {
    BUSY.set(true);
    let mut own: Vec<(usize, R)> = Vec::new();
    loop {
        let index = next.fetch_add(1, Ordering::Relaxed);
        let Some(item) = items.get(index) else { return own };
        own.push((index, work(item)));
    }
}

/// What a thread comes to. A panic in it goes on here: a fraction that is missing would be a wrong result.
fn joined<R>(handle: ScopedJoinHandle<'_, R>) -> R {
    handle.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
}

/// Runs `work` over chunks of `items` on as many threads as the machine has, and hands each thread's sum to `join`.
pub fn over_chunks<S: Send>(
    items: &[usize],
    start: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, &[usize]) + Sync,
    mut join: impl FnMut(S),
) {
    // Fewer than four chunks a thread are done sooner than a thread is started.
    let threads = cores().min(items.len().div_ceil(4 * CHUNK)).max(1);
    if threads == 1 {
        return join(sum_of(items, start, work));
    }
    let fraction = items.len().div_ceil(threads);
    let sums: Vec<S> = std::thread::scope(|scope| {
        let (start, work) = (&start, &work);
        let handles: Vec<_> =
            items.chunks(fraction).map(|part| scope.spawn(move || sum_of(part, start, work))).collect();
        handles.into_iter().map(joined).collect()
    });
    sums.into_iter().for_each(join);
}

fn sum_of<S>(items: &[usize], start: impl Fn() -> S, work: impl Fn(&mut S, &[usize])) -> S {
    let mut sum = start();
    items.chunks(CHUNK).for_each(|chunk| work(&mut sum, chunk));
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_come_in_the_items_order() {
        let items: Vec<u64> = (0..500).collect();
        let squares = for_each(&items, |item| item * item);
        assert!(squares.into_iter().eq(items.iter().map(|item| item * item)));
        assert!(for_each(&[] as &[u64], |item| *item).is_empty());
    }

    #[test]
    fn work_inside_work_is_done_by_the_same_thread() {
        let sums = for_each(&[10_usize, 20, 30], |count| {
            let inner: Vec<usize> = (0..*count).collect();
            for_each(&inner, |item| *item).into_iter().sum::<usize>()
        });
        assert_eq!(sums, [45, 190, 435]);
    }

    #[test]
    fn chunks_cover_every_item_once() {
        for count in [0, 1, CHUNK, 10 * CHUNK + 7] {
            let items: Vec<usize> = (0..count).collect();
            let mut total = (0, 0);
            over_chunks(
                &items,
                || (0, 0),
                |sum, chunk| *sum = (sum.0 + chunk.len(), sum.1 + chunk.iter().sum::<usize>()),
                |part| total = (total.0 + part.0, total.1 + part.1),
            );
            assert_eq!(total, (count, items.iter().sum::<usize>()));
        }
    }

    #[test]
    #[should_panic(expected = "one item fails")]
    fn a_panic_in_one_item_is_not_swallowed() {
        let items: Vec<usize> = (0..64).collect();
        for_each(&items, |item| assert!(*item != 17, "one item fails"));
    }

    #[test]
    #[should_panic(expected = "one chunk fails")]
    fn a_panic_in_one_chunk_is_not_swallowed() {
        let items: Vec<usize> = (0..64 * CHUNK).collect();
        over_chunks(&items, || (), |(), chunk| assert!(!chunk.contains(&17), "one chunk fails"), |()| ());
    }

    #[test]
    fn a_computation_may_use_every_core_and_one_inside_it_its_own() {
        let all = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        // Asked in a thread of its own: that of a test may have been at work before.
        assert_eq!(std::thread::spawn(cores).join().unwrap(), all);
        if all > 1 {
            assert_eq!(for_each(&[0, 1], |_| cores()), [1, 1]);
        }
    }
}
