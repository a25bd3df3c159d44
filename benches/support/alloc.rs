//! An allocator that counts, to show that a path does not allocate.
//!
//! A bench or test installs it with `#[global_allocator]` and asks [`allocations_during`]. A count
//! of 0 means something only after [`counts_at_all`] was true.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicU64, Ordering};

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

/// The system's allocator with a count of allocations and reallocations.
pub(crate) struct CountingAllocator;

// SAFETY: every call is passed on unchanged to the system's allocator, which keeps the contract.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promises are the ones this call needs.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: `pointer` came from `alloc` or `realloc`, hence from `System`.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, new_size: usize) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: as for `dealloc`; the caller's promises cover `new_size`.
        unsafe { System.realloc(pointer, layout, new_size) }
    }
}

/// Allocations, of all threads, while `operation` runs.
pub(crate) fn allocations_during(operation: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    operation();
    ALLOCATIONS.load(Ordering::Relaxed) - before
}

/// The positive control: whether the allocator is installed and sees an allocation.
pub(crate) fn counts_at_all() -> bool {
    allocations_during(|| drop(std::hint::black_box(Box::new(0_u64)))) > 0
}
