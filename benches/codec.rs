//! The codec against copying, hand-written C, `binrw` and `packed_struct`, side by side in one run.
//!
//! `cargo bench --bench codec`, with `-- --quick` for a first look. Times need a quiet machine; the
//! instruction counts (of valgrind's callgrind, if it is installed) hold on any.

mod support;
mod codec {
    pub(crate) mod binrw_ops;
    pub(crate) mod c_ops;
    pub(crate) mod fieldarm_ops;
    pub(crate) mod packed_ops;
    pub(crate) mod samples;
}

use std::hint::black_box;

use codec::{binrw_ops, c_ops, fieldarm_ops, packed_ops, samples};
use fieldarm::wire::meca500::image::{INPUT_LEN, InputImage, OUTPUT_LEN};
use fieldarm::wire::order::{Big, ImageOrder, Little};
use support::{Group, Subject};

const REFERENCES: &[&str] = &["memcpy", "C"];

#[global_allocator]
static ALLOCATOR: support::alloc::CountingAllocator = support::alloc::CountingAllocator;

fn main() {
    let c = c_ops::load().inspect_err(|reason| println!("No C: {reason}.")).ok();
    let (c_big, c_little) = c.unzip();
    let mut groups = Vec::new();
    groups.extend(decode(c_big, c_little));
    groups.extend(encode(c_big, c_little));
    groups.extend(reads(c_big, c_little));
    let figures = support::measure(&mut groups, support::timing::Effort::from_args());
    println!(
        "Each operation is a call that is not inlined; the C is compiled with cc -O2, all else"
    );
    println!(
        "by rustc's release profile, both for the target's baseline CPU. binrw and packed_struct write"
    );
    println!(
        "reserved bits as 0, as the C does; fieldarm keeps them. packed_struct knows no floats: its"
    );
    println!("Reals stay bits. ns: median and least of many batches; x: ratio of the medians;");
    println!("instructions: within the call and what it calls.");
    support::table::print(&groups, &figures);
    print_allocations();
}

/// Within one page, so that no subject is slower for where its bytes happen to lie.
#[repr(align(512))]
struct Aligned<T>(T);

/// One operation: `input` is hidden from the optimiser, and so is what becomes of the result.
macro_rules! subject {
    ($name:literal, $input:expr, |$hidden:ident| $operation:expr) => {{
        let input = Aligned($input);
        Subject::new($name, move || {
            let $hidden = &black_box(&input).0;
            black_box(&$operation);
        })
    }};
}

/// One operation that writes to memory its caller holds.
macro_rules! writing_subject {
    ($name:literal, $input:expr, $room:expr, |$hidden:ident, $to:ident| $operation:expr) => {{
        let input = Aligned($input);
        let mut room = Aligned($room);
        Subject::new($name, move || {
            let ($hidden, $to) = (&black_box(&input).0, &mut black_box(&mut room).0);
            $operation;
            black_box(&room);
        })
    }};
}

fn memcpy<const N: usize>(bytes: [u8; N]) -> Subject {
    writing_subject!("memcpy", bytes, [0; N], |from, to| fieldarm_ops::measured_copy(from, to))
}

fn decode(c_big: Option<c_ops::Ops>, c_little: Option<c_ops::Ops>) -> [Group; 2] {
    fn shared<O: ImageOrder>(c: Option<c_ops::Ops>) -> Vec<Subject> {
        let bytes = samples::input::<O>();
        let mut subjects = vec![memcpy(bytes)];
        subjects.extend(c.map(|c| {
            let mut values = c_ops::Input::default();
            c.decode(&bytes, &mut values);
            samples::check_input::<O>("C", &values);
            writing_subject!("C", bytes, values, |bytes, values| c.decode(bytes, values))
        }));
        subjects.push(subject!("fieldarm", bytes, |bytes| {
            fieldarm_ops::measured_decode::<O>(bytes)
        }));
        subjects
    }

    let mut big = shared::<Big>(c_big);
    let bytes = samples::input::<Big>();
    samples::check_input::<Big>("binrw", &binrw_ops::measured_decode::<true>(&bytes));
    samples::check_input::<Big>("packed_struct", &packed_ops::big::measured_decode(&bytes));
    big.push(subject!("binrw", bytes, |bytes| binrw_ops::measured_decode::<true>(bytes)));
    big.push(subject!("packed_struct", bytes, |bytes| packed_ops::big::measured_decode(bytes)));

    let mut little = shared::<Little>(c_little);
    let bytes = samples::input::<Little>();
    samples::check_input::<Little>("binrw", &binrw_ops::measured_decode::<false>(&bytes));
    samples::check_input::<Little>("packed_struct", &packed_ops::little::measured_decode(&bytes));
    little.push(subject!("binrw", bytes, |bytes| binrw_ops::measured_decode::<false>(bytes)));
    little
        .push(subject!("packed_struct", bytes, |bytes| packed_ops::little::measured_decode(bytes)));

    [
        Group { title: "decode 252 bytes, big", subjects: big, references: REFERENCES },
        Group { title: "decode 252 bytes, little", subjects: little, references: REFERENCES },
    ]
}

fn encode(c_big: Option<c_ops::Ops>, c_little: Option<c_ops::Ops>) -> [Group; 2] {
    const ROOM: [u8; OUTPUT_LEN] = [0; OUTPUT_LEN];

    fn check<O: ImageOrder>(subject: &str, write: impl FnOnce(&mut [u8; OUTPUT_LEN])) {
        let mut bytes = ROOM;
        write(&mut bytes);
        assert_eq!(bytes[..], samples::output_bytes::<O>(), "{subject} encodes something else");
    }

    fn shared<O: ImageOrder>(c: Option<c_ops::Ops>) -> Vec<Subject> {
        let values = samples::output();
        let mut subjects = vec![memcpy::<OUTPUT_LEN>(ROOM)];
        subjects.extend(c.map(|c| {
            let values = c_ops::Output::from(&values);
            check::<O>("C", |bytes| c.encode(&values, bytes));
            writing_subject!("C", values, ROOM, |values, bytes| c.encode(values, bytes))
        }));
        subjects.push(writing_subject!("fieldarm", values, ROOM, |values, bytes| {
            fieldarm_ops::measured_encode::<O>(values, bytes)
        }));
        subjects
    }

    let values = samples::output();
    let (binrw, packed_big, packed_little) = (
        binrw_ops::Output::from(&values),
        packed_ops::big::Output::from(&values),
        packed_ops::little::Output::from(&values),
    );
    check::<Big>("binrw", |bytes| {
        binrw_ops::measured_encode::<true>(&binrw, bytes);
    });
    check::<Little>("binrw", |bytes| {
        binrw_ops::measured_encode::<false>(&binrw, bytes);
    });
    check::<Big>("packed_struct", |bytes| packed_ops::big::measured_encode(&packed_big, bytes));
    check::<Little>("packed_struct", |bytes| {
        packed_ops::little::measured_encode(&packed_little, bytes);
    });

    let mut big = shared::<Big>(c_big);
    big.push(writing_subject!("binrw", binrw, ROOM, |values, bytes| {
        binrw_ops::measured_encode::<true>(values, bytes)
    }));
    big.push(writing_subject!("packed_struct", packed_big, ROOM, |values, bytes| {
        packed_ops::big::measured_encode(values, bytes)
    }));
    let mut little = shared::<Little>(c_little);
    little.push(writing_subject!("binrw", binrw, ROOM, |values, bytes| {
        binrw_ops::measured_encode::<false>(values, bytes)
    }));
    little.push(writing_subject!("packed_struct", packed_little, ROOM, |values, bytes| {
        packed_ops::little::measured_encode(values, bytes)
    }));

    [
        Group { title: "encode 60 bytes, big", subjects: big, references: REFERENCES },
        Group { title: "encode 60 bytes, little", subjects: little, references: REFERENCES },
    ]
}

fn reads(c_big: Option<c_ops::Ops>, c_little: Option<c_ops::Ops>) -> [Group; 2] {
    fn expected<O: ImageOrder>(bytes: &[u8; INPUT_LEN]) -> c_ops::Reads {
        let mut reads = fieldarm_ops::Reads::default();
        let image = InputImage::<O>::from_bytes(bytes).expect("the length of the image");
        fieldarm_ops::measured_reads(image, &mut reads);
        c_ops::Reads {
            status_bits: reads.status.bits(),
            error_code: reads.error_code,
            checkpoint_reached: reads.checkpoint_reached as u16,
            checkpoint_discarded: reads.checkpoint_discarded as u16,
            move_id: reads.move_id,
            fifo_space: reads.fifo_space,
            motion_bits: reads.motion.bits(),
            seconds: reads.seconds,
            microseconds: reads.microseconds,
            signal_bits: reads.signals.bits(),
            resettable_bits: reads.resettable.bits(),
            dynamic_types: reads.dynamic_types,
        }
    }

    fn shared<O: ImageOrder>(c: Option<c_ops::Ops>) -> Vec<Subject> {
        let bytes = samples::input::<O>();
        let mut subjects = vec![memcpy(bytes)];
        subjects.extend(c.map(|c| {
            let mut found = c_ops::Reads::default();
            c.reads(&bytes, &mut found);
            samples::check("C", &expected::<O>(&bytes), &found);
            writing_subject!("C", bytes, found, |bytes, reads| c.reads(bytes, reads))
        }));
        let image = *InputImage::<O>::from_bytes(&bytes).expect("the length of the image");
        let reads = fieldarm_ops::Reads::default();
        subjects.push(writing_subject!("fieldarm", image, reads, |image, reads| {
            fieldarm_ops::measured_reads::<O>(image, reads)
        }));
        subjects
    }

    let mut big = shared::<Big>(c_big);
    let bytes = samples::input::<Big>();
    let found = expected::<Big>(&bytes);
    samples::check("binrw", &found, &binrw_ops::measured_reads::<true>(&bytes));
    samples::check("packed_struct", &found, &packed_ops::big::measured_reads(&bytes));
    big.push(subject!("binrw", bytes, |bytes| binrw_ops::measured_reads::<true>(bytes)));
    big.push(subject!("packed_struct", bytes, |bytes| packed_ops::big::measured_reads(bytes)));

    let mut little = shared::<Little>(c_little);
    let bytes = samples::input::<Little>();
    let found = expected::<Little>(&bytes);
    samples::check("binrw", &found, &binrw_ops::measured_reads::<false>(&bytes));
    samples::check("packed_struct", &found, &packed_ops::little::measured_reads(&bytes));
    little.push(subject!("binrw", bytes, |bytes| binrw_ops::measured_reads::<false>(bytes)));
    little
        .push(subject!("packed_struct", bytes, |bytes| packed_ops::little::measured_reads(bytes)));

    [
        Group { title: "the engine's reads, big", subjects: big, references: REFERENCES },
        Group { title: "the engine's reads, little", subjects: little, references: REFERENCES },
    ]
}

fn print_allocations() {
    let bytes = samples::input::<Big>();
    let mut room = [0; OUTPUT_LEN];
    let allocations = support::alloc::allocations_during(|| {
        black_box(fieldarm_ops::measured_decode::<Big>(black_box(&bytes)));
        fieldarm_ops::measured_encode::<Big>(black_box(&samples::output()), black_box(&mut room));
    });
    assert!(support::alloc::counts_at_all(), "the allocation counter sees nothing");
    println!("\nAllocations of one decode and one encode: {allocations} (the counter works).");
}
