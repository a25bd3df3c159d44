//! Status numbers, their categories and words.

use fieldarm::wire::enip::encapsulation::EncapsulationStatus;
use fieldarm::wire::enip::status::{ExtendedStatus, GeneralStatus, Refusal};

/// Each number that the standard defines up to 0x0139, with the category that it belongs to.
const CATEGORIES: &[(&[u16], Refusal)] = &[
    (&[0x0100], Refusal::InUse),
    (&[0x0106], Refusal::Ownership),
    (&[0x0107], Refusal::NotFound),
    (&[0x0109, 0x0127, 0x0128, 0x0134], Refusal::Size),
    (&[0x0110], Refusal::NotConfigured),
    (&[0x0111, 0x0112, 0x011B], Refusal::Interval),
    (&[0x0113, 0x011A, 0x0301, 0x0302, 0x0303, 0x0319, 0x031E, 0x031F], Refusal::OutOfConnections),
    (&[0x0114, 0x0115, 0x0116], Refusal::Key),
    (
        &[
            0x0117, 0x0118, 0x0126, 0x0129, 0x012A, 0x012B, 0x012C, 0x012D, 0x012E, 0x012F, 0x0311,
            0x0312, 0x0315, 0x0316, 0x0318,
        ],
        Refusal::Path,
    ),
    (&[0x0119], Refusal::NoOwner),
    (
        &[
            0x0103, 0x0108, 0x011C, 0x011D, 0x011E, 0x011F, 0x0120, 0x0121, 0x0122, 0x0123, 0x0124,
            0x0125, 0x0130, 0x0131, 0x0132, 0x0133, 0x0135, 0x0136, 0x0137, 0x0138, 0x0139, 0x0304,
            0x0317,
        ],
        Refusal::Parameters,
    ),
    (&[0x0203, 0x0204, 0x0207], Refusal::TimedOut),
];

#[test]
fn every_number_has_its_category() {
    let mut listed = 0;
    for status in 0..=u16::MAX {
        let expected = CATEGORIES
            .iter()
            .find(|(numbers, _)| numbers.contains(&status))
            .map_or(Refusal::Other, |(_, category)| *category);
        listed += usize::from(expected != Refusal::Other);
        assert_eq!(ExtendedStatus(status).category(), expected, "0x{status:04X}");
    }
    assert_eq!(listed, CATEGORIES.iter().map(|(numbers, _)| numbers.len()).sum::<usize>());
}

/// A number in a category other than `Other` also has words of its own, each number others.
#[test]
fn every_number_has_words() {
    let mut seen = std::collections::HashMap::new();
    for status in 0..=u16::MAX {
        let status = ExtendedStatus(status);
        let shown = status.to_string();
        assert!(shown.starts_with(&format!("0x{:04X}: ", status.0)) && shown.contains("; "));
        match status.meaning() {
            Some(meaning) => {
                assert!(shown.contains(meaning));
                if let Some(other) = seen.insert(meaning, status.0) {
                    assert_eq!((other, status.0), (0x031E, 0x031F), "{meaning}");
                }
            }
            None => assert_eq!(status.category(), Refusal::Other, "{shown}"),
        }
    }
    assert!(seen.len() > 70, "only {} numbers have words", seen.len());
}

#[test]
fn constants_have_their_numbers() {
    for (status, number, category) in [
        (ExtendedStatus::IN_USE, 0x0100, Refusal::InUse),
        (ExtendedStatus::TRANSPORT_NOT_SUPPORTED, 0x0103, Refusal::Parameters),
        (ExtendedStatus::OWNERSHIP_CONFLICT, 0x0106, Refusal::Ownership),
        (ExtendedStatus::NOT_FOUND, 0x0107, Refusal::NotFound),
        (ExtendedStatus::INVALID_PARAMETERS, 0x0108, Refusal::Parameters),
        (ExtendedStatus::INVALID_SIZE, 0x0109, Refusal::Size),
        (ExtendedStatus::RPI_NOT_SUPPORTED, 0x0111, Refusal::Interval),
        (ExtendedStatus::OUT_OF_CONNECTIONS, 0x0113, Refusal::OutOfConnections),
        (ExtendedStatus::VENDOR_OR_PRODUCT_MISMATCH, 0x0114, Refusal::Key),
        (ExtendedStatus::DEVICE_TYPE_MISMATCH, 0x0115, Refusal::Key),
        (ExtendedStatus::REVISION_MISMATCH, 0x0116, Refusal::Key),
        (ExtendedStatus::INVALID_APPLICATION_PATH, 0x0117, Refusal::Path),
        (ExtendedStatus::INVALID_CONFIGURATION_FORMAT, 0x0118, Refusal::Path),
        (ExtendedStatus::NO_OWNER, 0x0119, Refusal::NoOwner),
        (ExtendedStatus::O2T_TYPE, 0x0123, Refusal::Parameters),
        (ExtendedStatus::T2O_TYPE, 0x0124, Refusal::Parameters),
        (ExtendedStatus::O2T_SIZE, 0x0127, Refusal::Size),
        (ExtendedStatus::T2O_SIZE, 0x0128, Refusal::Size),
        (ExtendedStatus::INVALID_CONFIGURATION_PATH, 0x0129, Refusal::Path),
        (ExtendedStatus::INVALID_CONSUMING_PATH, 0x012A, Refusal::Path),
        (ExtendedStatus::INVALID_PRODUCING_PATH, 0x012B, Refusal::Path),
        (ExtendedStatus::INCONSISTENT_PATH, 0x012F, Refusal::Path),
        (ExtendedStatus::MULTIPLIER_NOT_ACCEPTABLE, 0x0133, Refusal::Parameters),
        (ExtendedStatus::CONNECTION_TIMED_OUT, 0x0203, Refusal::TimedOut),
        (ExtendedStatus::REQUEST_TIMED_OUT, 0x0204, Refusal::TimedOut),
        (ExtendedStatus::INVALID_SEGMENT, 0x0315, Refusal::Path),
    ] {
        assert_eq!((status.0, status.category()), (number, category));
    }
}

#[test]
fn words_of_general_and_encapsulation_status() {
    let mut words: Vec<_> = (0..=0x2C)
        .map(|status| GeneralStatus(status).to_string().split_once(": ").unwrap().1.to_owned())
        .collect();
    assert!(words.iter().all(|words| words != "see the device's manual"));
    words.sort_unstable();
    words.dedup();
    assert_eq!(words.len(), 0x2D, "two numbers have the same words");
    assert_eq!(GeneralStatus(0xD0).to_string(), "0xD0: see the device's manual");
    assert_eq!(GeneralStatus::ATTRIBUTE_NOT_SUPPORTED.to_string(), "0x14: attribute not supported");
    for (status, expected) in [
        (EncapsulationStatus::INVALID_SESSION, "0x0064: session handle unknown"),
        (EncapsulationStatus::NOT_ON_THIS_PORT, "0x006A: service not allowed on this port"),
        (EncapsulationStatus(0x99), "0x0099: not a status of the standard"),
    ] {
        assert_eq!(status.to_string(), expected);
    }
}
