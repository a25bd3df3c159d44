//! SDO transfers byte by byte, as ETG.1000 part 6 lays them out, on the robot's own dictionary.

mod coe_support;

use coe_support::*;
use fieldarm::bus::ethercat::meca500::Meca500Settings;
use fieldarm::wire::ethercat::al::AlState;

fn robot() -> Firmware {
    firmware(Meca500Settings { serial: 0x1234_5678, ..Default::default() })
}

#[test]
fn small_values_are_read_expedited() {
    dialogue(
        &mut robot(),
        &[
            ("00 20 40 18 10 01 00 00 00 00", "00 30 43 18 10 01 E1 AD EC 00"),
            ("00 20 40 18 10 02 00 00 00 00", "00 30 43 18 10 02 00 D5 04 00"),
            ("00 20 40 18 10 03 00 00 00 00", "00 30 43 18 10 03 01 00 00 00"),
            ("00 20 40 18 10 04 00 00 00 00", "00 30 43 18 10 04 78 56 34 12"),
            ("00 20 40 18 10 00 00 00 00 00", "00 30 4F 18 10 00 04 00 00 00"),
            ("00 20 40 12 1C 01 00 00 00 00", "00 30 4B 12 1C 01 00 16 00 00"),
            ("00 20 40 00 1C 03 00 00 00 00", "00 30 4F 00 1C 03 03 00 00 00"),
            ("00 20 40 32 1C 05 00 00 00 00", "00 30 43 32 1C 05 40 42 0F 00"),
            ("00 20 40 33 1C 04 00 00 00 00", "00 30 4B 33 1C 04 06 00 00 00"),
        ],
    );
}

#[test]
fn longer_values_are_read_normally() {
    // "Meca500" is 7 bytes, "11.3.84" too; "R3" fits into an expedited answer.
    dialogue(
        &mut robot(),
        &[
            ("00 20 40 08 10 00 00 00 00 00", "00 30 41 08 10 00 07 00 00 00 4D 65 63 61 35 30 30"),
            ("00 20 40 0A 10 00 00 00 00 00", "00 30 41 0A 10 00 07 00 00 00 31 31 2E 33 2E 38 34"),
            ("00 20 40 09 10 00 00 00 00 00", "00 30 4B 09 10 00 52 33 00 00"),
        ],
    );
}

#[test]
fn process_data_are_read_bit_by_bit_from_the_images() {
    // Input byte n holds n: byte 1 is 01h, so bit 8 (WorkZoneStatus, 6010h:0A) is 1 and bit 9 is 0.
    // Byte 12 is 0Ch: EOM (6015h:08, bit 2) and Cleared (09, bit 3) are 1, Paused (06) is 0.
    dialogue(
        &mut robot(),
        &[
            ("00 20 40 10 60 01 00 00 00 00", "00 30 4B 10 60 01 02 03 00 00"),
            ("00 20 40 10 60 0A 00 00 00 00", "00 30 4F 10 60 0A 01 00 00 00"),
            ("00 20 40 10 60 0B 00 00 00 00", "00 30 4F 10 60 0B 00 00 00 00"),
            ("00 20 40 15 60 06 00 00 00 00", "00 30 4F 15 60 06 00 00 00 00"),
            ("00 20 40 15 60 08 00 00 00 00", "00 30 4F 15 60 08 01 00 00 00"),
            ("00 20 40 15 60 04 00 00 00 00", "00 30 4B 15 60 04 0A 0B 00 00"),
            ("00 20 40 46 60 04 00 00 00 00", "00 30 4F 46 60 04 43 00 00 00"),
            ("00 20 40 73 60 07 00 00 00 00", "00 30 43 73 60 07 F8 F9 FA FB"),
        ],
    );
}

#[test]
fn an_assignment_is_written_expedited() {
    dialogue(
        &mut robot(),
        &[
            ("00 20 2F 13 1C 00 00 00 00 00", "00 30 60 13 1C 00 00 00 00 00"),
            ("00 20 2B 13 1C 01 01 1A 00 00", "00 30 60 13 1C 01 00 00 00 00"),
            ("00 20 2B 13 1C 02 00 1A 00 00", "00 30 60 13 1C 02 00 00 00 00"),
            ("00 20 2F 13 1C 00 02 00 00 00", "00 30 60 13 1C 00 00 00 00 00"),
            ("00 20 40 13 1C 00 00 00 00 00", "00 30 4F 13 1C 00 02 00 00 00"),
            ("00 20 40 13 1C 01 00 00 00 00", "00 30 4B 13 1C 01 01 1A 00 00"),
            // Without a size, as many bytes count as the entry has.
            ("00 20 22 13 1C 00 00 EE EE EE", "00 30 60 13 1C 00 00 00 00 00"),
            // A normal transfer of two bytes; the mailbox tells where they end.
            ("00 20 21 13 1C 01 02 00 00 00 08 1A", "00 30 60 13 1C 01 00 00 00 00"),
            ("00 20 40 13 1C 01 00 00 00 00", "00 30 4B 13 1C 01 08 1A 00 00"),
        ],
    );
}

#[test]
fn complete_access_reads_and_writes_an_assignment() {
    dialogue(
        &mut robot(),
        &[
            (
                "00 20 50 12 1C 00 00 00 00 00",
                "00 30 51 12 1C 00 14 00 00 00 09 00 00 16 01 16 02 16 10 16 11 16 20 16 21 16 22 16 23 16",
            ),
            (
                "00 20 50 12 1C 01 00 00 00 00",
                "00 30 51 12 1C 01 12 00 00 00 00 16 01 16 02 16 10 16 11 16 20 16 21 16 22 16 23 16",
            ),
            // Three PDOs in an order of their own, count and padding first.
            (
                "00 20 31 12 1C 00 08 00 00 00 03 00 02 16 00 16 01 16",
                "00 30 70 12 1C 00 00 00 00 00",
            ),
            (
                "00 20 50 12 1C 00 00 00 00 00",
                "00 30 51 12 1C 00 08 00 00 00 03 00 02 16 00 16 01 16",
            ),
            // Entries alone can be written only while none counts.
            ("00 20 33 12 1C 01 10 16 11 16", "00 20 80 12 1C 01 03 00 01 06"),
            ("00 20 2F 12 1C 00 00 00 00 00", "00 30 60 12 1C 00 00 00 00 00"),
            ("00 20 33 12 1C 01 10 16 11 16", "00 30 70 12 1C 01 00 00 00 00"),
            ("00 20 2F 12 1C 00 02 00 00 00", "00 30 60 12 1C 00 00 00 00 00"),
            ("00 20 50 12 1C 01 00 00 00 00", "00 30 53 12 1C 01 10 16 11 16"),
            // An empty assignment, expedited: two bytes.
            ("00 20 3B 12 1C 00 00 00 00 00", "00 30 70 12 1C 00 00 00 00 00"),
            ("00 20 50 12 1C 00 00 00 00 00", "00 30 5B 12 1C 00 00 00 00 00"),
        ],
    );
}

#[test]
fn complete_access_packs_bits() {
    // 7410h: the count and its padding, then two bits. 6010h:01 is 16 bits wide, then ten bits:
    // the image's bits 0 to 9, of bytes 00 01.
    dialogue(
        &mut robot(),
        &[
            ("00 20 50 10 74 00 00 00 00 00", "00 30 57 10 74 00 02 00 00 00"),
            ("00 20 50 10 60 00 00 00 00 00", "00 30 51 10 60 00 06 00 00 00 0B 00 02 03 00 01"),
            ("00 20 50 10 60 01 00 00 00 00", "00 30 53 10 60 01 02 03 00 01"),
            ("00 20 50 46 60 01 00 00 00 00", "00 30 53 46 60 01 40 41 42 43"),
            // 6065h numbers its reserved bits: as a whole it lies as in the image, 80h to 8Ah, with
            // the reserved bits (4 of 80h, 20 behind 132:3 and so on) left 0.
            (
                "00 20 50 65 60 00 00 00 00 00",
                "00 30 51 65 60 00 0D 00 00 00 4F 00 80 01 00 00 84 05 00 00 88 01 0A",
            ),
        ],
    );
}

#[test]
fn a_mapping_longer_than_the_mailbox_comes_in_segments() {
    let mut robot = robot();
    // 1A11h as a whole: 2 bytes and 37 entries of 4, of which 112 fit into the first datagram.
    let first = ask(&mut robot, "00 20 50 11 1A 00 00 00 00 00");
    let first = bytes(&first);
    assert_eq!(hex(&first[..10]), "00 30 51 11 1A 00 96 00 00 00");
    assert_eq!(first.len(), 122);
    let second = bytes(&ask(&mut robot, "00 20 60 00 00 00 00 00 00 00"));
    // The last segment, toggle 0, 38 bytes.
    assert_eq!(hex(&second[..3]), "00 30 01");
    assert_eq!(second.len(), 3 + 38);
    let whole = [&first[10..], &second[3..]].concat();
    assert_eq!(whole.len(), 150);
    assert_eq!(hex(&whole[..10]), "25 00 01 01 65 60 01 02 65 60");
    assert_eq!(hex(&whole[14..18]), "01 00 00 00", "the reserved bit 128:3");
    assert_eq!(hex(&whole[146..]), "0A 00 00 00", "the reserved bits 138:6");
    // Nothing is left to read.
    assert_eq!(ask(&mut robot, "00 20 70 00 00 00 00 00 00 00"), "00 20 80 00 00 00 01 00 04 05");
}

#[test]
fn a_segmented_download_writes_an_assignment() {
    dialogue(
        &mut robot(),
        &[
            // 8 bytes announced, 1 in the first datagram, 7 in one segment.
            ("00 20 31 12 1C 00 08 00 00 00 03", "00 30 70 12 1C 00 00 00 00 00"),
            ("00 20 01 00 02 16 00 16 01 16", "00 30 20 00 00 00 00 00 00 00"),
            (
                "00 20 50 12 1C 00 00 00 00 00",
                "00 30 51 12 1C 00 08 00 00 00 03 00 02 16 00 16 01 16",
            ),
            // 4 bytes in four segments of one: six bytes of each do not count.
            ("00 20 31 12 1C 00 04 00 00 00", "00 30 70 12 1C 00 00 00 00 00"),
            ("00 20 0C 01 EE EE EE EE EE EE", "00 30 20 00 00 00 00 00 00 00"),
            ("00 20 1C 00 EE EE EE EE EE EE", "00 30 30 00 00 00 00 00 00 00"),
            ("00 20 0C 10 EE EE EE EE EE EE", "00 30 20 00 00 00 00 00 00 00"),
            ("00 20 1D 16 EE EE EE EE EE EE", "00 30 30 00 00 00 00 00 00 00"),
            ("00 20 50 12 1C 00 00 00 00 00", "00 30 53 12 1C 00 01 00 10 16"),
        ],
    );
}

#[test]
fn a_transfer_ends_with_an_abort_from_either_end() {
    let mut robot = robot();
    dialogue(
        &mut robot,
        &[
            // The toggle bit must begin with 0 ...
            ("00 20 31 12 1C 00 08 00 00 00 03", "00 30 70 12 1C 00 00 00 00 00"),
            ("00 20 11 00 02 16 00 16 01 16", "00 20 80 12 1C 00 00 00 03 05"),
            // ... and after the abort no transfer is left.
            ("00 20 01 00 02 16 00 16 01 16", "00 20 80 00 00 00 01 00 04 05"),
            // More than announced; less than announced, and yet the last.
            ("00 20 31 12 1C 00 04 00 00 00 03", "00 30 70 12 1C 00 00 00 00 00"),
            ("00 20 01 00 02 16 00 16 01 16", "00 20 80 12 1C 00 12 00 07 06"),
            ("00 20 31 12 1C 00 10 00 00 00 03", "00 30 70 12 1C 00 00 00 00 00"),
            ("00 20 01 00 02 16 00 16 01 16", "00 20 80 12 1C 00 10 00 07 06"),
            // Reading on in a download.
            ("00 20 31 12 1C 00 08 00 00 00 03", "00 30 70 12 1C 00 00 00 00 00"),
            ("00 20 60 00 00 00 00 00 00 00", "00 20 80 12 1C 00 01 00 04 05"),
        ],
    );
    // The main device gives up: no answer, and the transfer is gone.
    for start in ["00 20 31 12 1C 00 08 00 00 00 03", "00 20 50 11 1A 00 00 00 00 00"] {
        ask(&mut robot, start);
        let abort = coe(&bytes("00 20 80 12 1C 00 00 00 00 08"));
        assert_eq!(ask_bytes(&mut robot, AlState::PreOp, &abort), None);
        assert_eq!(
            ask(&mut robot, "00 20 60 00 00 00 00 00 00 00"),
            "00 20 80 00 00 00 01 00 04 05"
        );
    }
    // The upload's toggle bit.
    ask(&mut robot, "00 20 50 11 1A 00 00 00 00 00");
    assert_eq!(ask(&mut robot, "00 20 70 00 00 00 00 00 00 00"), "00 20 80 11 1A 00 00 00 03 05");
    // Writing on in an upload.
    ask(&mut robot, "00 20 50 11 1A 00 00 00 00 00");
    assert_eq!(ask(&mut robot, "00 20 01 00 02 16 00 16 01 16"), "00 20 80 11 1A 00 01 00 04 05");
}

#[test]
fn refusals_name_their_reason() {
    let pre_op = [
        // Unknown commands (block transfers).
        ("00 20 A0 12 1C 00 00 00 00 00", "00 20 80 12 1C 00 01 00 04 05"),
        ("00 20 C0 12 1C 00 00 00 00 00", "00 20 80 12 1C 00 01 00 04 05"),
        // Longer than any transfer.
        ("00 20 31 12 1C 00 01 02 00 00 00", "00 20 80 12 1C 00 05 00 04 05"),
        // Complete access to a variable, from sub-index 2, and as a write to a record.
        ("00 20 50 00 10 00 00 00 00 00", "00 20 80 00 10 00 00 00 01 06"),
        ("00 20 50 18 10 02 00 00 00 00", "00 20 80 18 10 02 00 00 01 06"),
        ("00 20 3F 12 1C 02 00 00 00 00", "00 20 80 12 1C 02 00 00 01 06"),
        ("00 20 33 32 1C 00 06 00 02 00", "00 20 80 32 1C 00 00 00 01 06"),
        // Read only: identity, count of a mapping, mapping.
        ("00 20 23 18 10 04 01 00 00 00", "00 20 80 18 10 04 02 00 01 06"),
        ("00 20 2F 00 1A 00 00 00 00 00", "00 20 80 00 1A 00 02 00 01 06"),
        ("00 20 23 00 1A 01 01 01 10 60", "00 20 80 00 1A 01 02 00 01 06"),
        ("00 20 2F 10 60 02 01 00 00 00", "00 20 80 10 60 02 02 00 01 06"),
        // The count is not 0.
        ("00 20 2B 12 1C 01 00 16 00 00", "00 20 80 12 1C 01 03 00 01 06"),
        // Outputs are written by the cycle.
        ("00 20 2F 00 72 02 01 00 00 00", "00 20 80 00 72 02 06 00 01 06"),
        ("00 20 23 05 73 00 01 00 00 00", "00 20 80 05 73 00 06 00 01 06"),
        // Nothing there.
        ("00 20 40 34 12 00 00 00 00 00", "00 20 80 34 12 00 00 00 02 06"),
        ("00 20 2F 34 12 00 00 00 00 00", "00 20 80 34 12 00 00 00 02 06"),
        ("00 20 50 34 12 00 00 00 00 00", "00 20 80 34 12 00 00 00 02 06"),
        ("00 20 40 18 10 05 00 00 00 00", "00 20 80 18 10 05 11 00 09 06"),
        ("00 20 40 00 10 01 00 00 00 00", "00 20 80 00 10 01 11 00 09 06"),
        ("00 20 40 65 60 04 00 00 00 00", "00 20 80 65 60 04 11 00 09 06"),
        ("00 20 2B 12 1C 0A 00 16 00 00", "00 20 80 12 1C 0A 11 00 09 06"),
        // Too long, too short.
        ("00 20 2B 12 1C 00 00 00 00 00", "00 20 80 12 1C 00 12 00 07 06"),
        ("00 20 2F 12 1C 01 00 16 00 00", "00 20 80 12 1C 01 13 00 07 06"),
        ("00 20 21 12 1C 00 01 00 00 00 00 00", "00 20 80 12 1C 00 12 00 07 06"),
        ("00 20 31 12 1C 00 03 00 00 00 01 00 00", "00 20 80 12 1C 00 10 00 07 06"),
        ("00 20 37 12 1C 01 00 16 01 00", "00 20 80 12 1C 01 10 00 07 06"),
        ("00 20 3B 12 1C 00 01 00 00 00", "00 20 80 12 1C 00 13 00 07 06"),
        // More PDOs than there are.
        ("00 20 2F 12 1C 00 0A 00 00 00", "00 20 80 12 1C 00 30 00 09 06"),
        ("00 20 3B 12 1C 00 0A 00 00 00", "00 20 80 12 1C 00 30 00 09 06"),
        // Synchronization: free run is not offered, nor a cycle below 1 ms.
        ("00 20 2B 32 1C 01 00 00 00 00", "00 20 80 32 1C 01 30 00 09 06"),
        ("00 20 23 32 1C 02 3F 42 0F 00", "00 20 80 32 1C 02 32 00 09 06"),
    ];
    dialogue(&mut robot(), &pre_op);
}

#[test]
fn an_assignment_that_cannot_be_is_refused_and_leaves_the_old_one() {
    let mut robot = robot();
    ask(&mut robot, "00 20 2F 12 1C 00 00 00 00 00");
    dialogue(
        &mut robot,
        &[
            // An input PDO and no PDO at all, as outputs.
            ("00 20 2B 12 1C 01 00 1A 00 00", "00 20 80 12 1C 01 41 00 04 06"),
            ("00 20 2B 12 1C 01 00 00 00 00", "00 20 80 12 1C 01 41 00 04 06"),
            // 1602h (28 bytes) three times: longer than the image.
            ("00 20 2B 12 1C 01 02 16 00 00", "00 30 60 12 1C 01 00 00 00 00"),
            ("00 20 2B 12 1C 02 02 16 00 00", "00 30 60 12 1C 02 00 00 00 00"),
            ("00 20 2B 12 1C 03 02 16 00 00", "00 30 60 12 1C 03 00 00 00 00"),
            ("00 20 2F 12 1C 00 03 00 00 00", "00 20 80 12 1C 00 42 00 04 06"),
            // Twice would fit, but a PDO is assigned once.
            ("00 20 2F 12 1C 00 02 00 00 00", "00 20 80 12 1C 00 41 00 04 06"),
            ("00 20 2F 12 1C 00 01 00 00 00", "00 30 60 12 1C 00 00 00 00 00"),
            // As a whole: a PDO that does not exist; nothing has changed.
            ("00 20 31 12 1C 00 06 00 00 00 02 00 00 16 03 16", "00 20 80 12 1C 00 41 00 04 06"),
            ("00 20 50 12 1C 00 00 00 00 00", "00 30 53 12 1C 00 01 00 02 16"),
        ],
    );
}

#[test]
fn settings_are_written_in_pre_op_only() {
    let mut robot = robot();
    for state in [AlState::SafeOp, AlState::Op] {
        for (request, answer) in [
            ("00 20 2F 12 1C 00 00 00 00 00", "00 20 80 12 1C 00 22 00 00 08"),
            ("00 20 2B 13 1C 01 00 1A 00 00", "00 20 80 13 1C 01 22 00 00 08"),
            ("00 20 3B 12 1C 00 00 00 00 00", "00 20 80 12 1C 00 22 00 00 08"),
            ("00 20 2B 33 1C 01 02 00 00 00", "00 20 80 33 1C 01 22 00 00 08"),
            // Reading goes on.
            ("00 20 40 12 1C 00 00 00 00 00", "00 30 4F 12 1C 00 09 00 00 00"),
        ] {
            assert_eq!(ask_in(&mut robot, state, request), answer, "{state}: {request}");
        }
    }
    dialogue(
        &mut robot,
        &[
            ("00 20 2B 32 1C 01 02 00 00 00", "00 30 60 32 1C 01 00 00 00 00"),
            ("00 20 40 32 1C 01 00 00 00 00", "00 30 4B 32 1C 01 02 00 00 00"),
            ("00 20 23 33 1C 02 80 84 1E 00", "00 30 60 33 1C 02 00 00 00 00"),
            ("00 20 40 33 1C 02 00 00 00 00", "00 30 43 33 1C 02 80 84 1E 00"),
            ("00 20 40 32 1C 02 00 00 00 00", "00 30 43 32 1C 02 40 42 0F 00"),
            // The inputs' own word for "with the outputs", 22h, is no choice of the outputs.
            ("00 20 2B 33 1C 01 22 00 00 00", "00 30 60 33 1C 01 00 00 00 00"),
            ("00 20 2B 32 1C 01 22 00 00 00", "00 20 80 32 1C 01 30 00 09 06"),
        ],
    );
}
