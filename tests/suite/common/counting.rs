//! An allocator that counts each thread's allocations.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// Counters of a thread.
#[derive(Clone, Copy, Default)]
struct Count {
    allocations: usize,
    held_bytes: usize,
    peak_bytes: usize,
}

thread_local! {
    static COUNT: Cell<Count> = const { Cell::new(Count { allocations: 0, held_bytes: 0, peak_bytes: 0 }) };
}

struct Counting;

fn count(change: impl FnOnce(&mut Count)) {
    // A thread that ends has no counter any more.
    let _ = COUNT.try_with(|cell| {
        let mut count = cell.get();
        change(&mut count);
        cell.set(count);
    });
}

// SAFETY: all calls are passed to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(|count| {
            count.allocations += 1;
            count.held_bytes = count.held_bytes.wrapping_add(layout.size());
            count.peak_bytes = count.peak_bytes.max(count.held_bytes);
        });
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // Memory of another thread may be freed here.
        count(|count| count.held_bytes = count.held_bytes.saturating_sub(layout.size()));
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// Number of allocations of `work` on this thread.
pub fn allocations(work: impl FnOnce()) -> usize {
    let before = COUNT.get().allocations;
    work();
    COUNT.get().allocations - before
}

/// Peak memory of `work` on this thread, bytes above the initial memory.
pub fn peak_bytes<R>(work: impl FnOnce() -> R) -> usize {
    let before = COUNT.get().held_bytes;
    count(|count| count.peak_bytes = before);
    let kept = work();
    let peak = COUNT.get().peak_bytes - before;
    drop(kept);
    peak
}
