//! Reading and writing a robot's PDO layout over CoE.

use core::ops::Deref;
use std::vec::Vec;

use ethercrab::error::{Error, MailboxError};
use ethercrab::{SubDevice, SubDeviceRef};

use super::layout::{Direction, MappingEntry};

/// What a robot maps in one direction, entry by entry.
pub(super) async fn read_mapping<S>(
    robot: &SubDeviceRef<'_, S>,
    direction: Direction,
) -> Result<Vec<MappingEntry>, Error>
where
    S: Deref<Target = SubDevice>,
{
    let assignment = direction.assignment_object();
    let mut entries = Vec::new();
    for slot in 1..=robot.sdo_read::<u8>(assignment, 0).await? {
        let pdo = robot.sdo_read::<u16>(assignment, slot).await?;
        for line in 1..=robot.sdo_read::<u8>(pdo, 0).await? {
            entries.push(MappingEntry::from_wire(pdo, robot.sdo_read::<u32>(pdo, line).await?));
        }
    }
    Ok(entries)
}

/// Assigns all PDOs of our image in its order. A robot that refuses keeps what it has: what it reports
/// is read afterwards anyway.
pub(super) async fn write_assignment<S>(
    robot: &SubDeviceRef<'_, S>,
    direction: Direction,
) -> Result<(), Error>
where
    S: Deref<Target = SubDevice>,
{
    let assignment = direction.assignment_object();
    let before = robot.sdo_read_array::<u16, 64>(assignment).await?;
    let written = write_list(robot, assignment, direction.pdos()).await;
    if !matches!(written, Err(Error::Mailbox(MailboxError::Aborted { .. }))) {
        return written;
    }
    // The list was emptied before the robot refused an entry of ours (older firmware lacks some).
    match write_list(robot, assignment, before.into_iter()).await {
        Err(Error::Mailbox(MailboxError::Aborted { .. })) => Ok(()),
        restored => restored,
    }
}

async fn write_list<S>(
    robot: &SubDeviceRef<'_, S>,
    object: u16,
    pdos: impl Iterator<Item = u16>,
) -> Result<(), Error>
where
    S: Deref<Target = SubDevice>,
{
    robot.sdo_write(object, 0, 0_u8).await?;
    let mut count = 0;
    for pdo in pdos {
        count += 1;
        robot.sdo_write(object, count, pdo).await?;
    }
    robot.sdo_write(object, 0, count).await
}
