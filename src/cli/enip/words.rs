//! What people read about EtherNet/IP connections, on both ends.

use std::prelude::v1::*;

use super::connect::Opened;
use crate::bus::enip::ConnectionKind;
use crate::bus::enip::adapter::{AdapterEvent, ConnectionStatus};
use crate::bus::enip::scanner::ScannerEvent;
use crate::link::enip::EnipError;
use crate::time::Duration;

/// `10 ms`, `2.5 ms`.
pub(in crate::cli) fn ms(duration: Duration) -> String {
    format!("{} ms", duration.as_nanos() as f64 * 1e-6)
}

/// Why the robots cannot be driven; robots count from 1 where there are several.
pub(in crate::cli) fn refusal(error: EnipError, robots: usize) -> String {
    match error {
        EnipError::Target { target, address, trouble } => match robots {
            1 => trouble.to_string(),
            _ => format!("robot {} at {address}: {trouble}", target + 1),
        },
        error => error.to_string(),
    }
}

/// The intervals of a connection, shortly where both are the same.
pub(in crate::cli) fn intervals(o2t: Duration, t2o: Duration) -> String {
    match o2t == t2o {
        true => format!("every {}", ms(o2t)),
        false => format!("every {} to the robot and every {} from it", ms(o2t), ms(t2o)),
    }
}

/// What was opened, where it is worth a line: when it is not what was asked for.
pub(in crate::cli) fn other_interval(opened: &Opened, asked: Duration) -> Option<String> {
    let Opened { o2t_api, t2o_api, .. } = *opened;
    (o2t_api != asked || t2o_api != asked).then(|| {
        format!("asked for frames every {}, granted {}", ms(asked), intervals(o2t_api, t2o_api))
    })
}

/// One line about what happened to a robot's connection, if it is worth one.
pub(in crate::cli) fn scanner_event(event: &ScannerEvent) -> Option<String> {
    Some(match event {
        ScannerEvent::Opened { o2t_api, t2o_api, .. } => {
            format!("EtherNet/IP connection open, frames {}", intervals(*o2t_api, *t2o_api))
        }
        ScannerEvent::Running { .. } => "its inputs arrive".into(),
        // Who ends over it does not wait for the next attempt.
        ScannerEvent::Failed { trouble, retry_in: Some(_), .. } => {
            format!("{trouble}; tried again if the command goes on")
        }
        ScannerEvent::Failed { trouble, retry_in: None, .. } => {
            format!("{trouble}; not tried again")
        }
        ScannerEvent::StreamLost { .. } => {
            "closed its TCP connection; its frames still come and go".into()
        }
        ScannerEvent::Closed { .. } => "EtherNet/IP connection closed".into(),
        ScannerEvent::Answered { .. } => return None,
    })
}

/// The robot that an event is about.
pub(in crate::cli) const fn target_of(event: &ScannerEvent) -> usize {
    match *event {
        ScannerEvent::Opened { target, .. }
        | ScannerEvent::Running { target }
        | ScannerEvent::Failed { target, .. }
        | ScannerEvent::StreamLost { target }
        | ScannerEvent::Closed { target }
        | ScannerEvent::Answered { target, .. } => target,
    }
}

/// What a connection may do.
pub(in crate::cli) const fn kind(kind: ConnectionKind) -> &'static str {
    match kind {
        ConnectionKind::ExclusiveOwner => "owner",
        ConnectionKind::InputOnly => "input-only",
        ConnectionKind::ListenOnly => "listen-only",
    }
}

/// One line about what happened on a served robot.
pub(in crate::cli) fn adapter_event(event: &AdapterEvent) -> String {
    match event {
        AdapterEvent::Opened(connection) => format!(
            "{} opened, frames {}{}",
            of(connection),
            intervals(connection.o2t_api, connection.t2o_api),
            if connection.is_multicast { ", inputs to a group" } else { "" }
        ),
        AdapterEvent::Closed(connection) => format!("{} closed", of(connection)),
        AdapterEvent::TimedOut(connection) => {
            format!("{} timed out: no frame came from it for too long", of(connection))
        }
        AdapterEvent::Refused { originator, general, extended } => {
            format!("refused a connection of {}: {general}, {extended}", originator.ip())
        }
        AdapterEvent::RunChanged { is_running: true } => "its owner runs".into(),
        AdapterEvent::RunChanged { is_running: false } => {
            "its owner idles: its outputs do not count".into()
        }
        AdapterEvent::ResetRequested => "somebody asked it to reset; it did nothing".into(),
    }
}

/// `owner connection of 127.0.0.1`.
fn of(connection: &ConnectionStatus) -> String {
    format!("{} connection of {}", kind(connection.kind), connection.originator.ip())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::enip::scanner::{ConfigPath, Trouble};

    #[test]
    fn no_attempt_is_promised_to_who_may_end_before_it() {
        let retry_in = Some(Duration::from_millis(200));
        let failed = |retry_in| {
            let trouble = Trouble::TimedOut { after: Duration::from_millis(160) };
            scanner_event(&ScannerEvent::Failed { target: 0, trouble, retry_in }).expect("words")
        };
        assert!(failed(retry_in).ends_with("; tried again if the command goes on"));
        assert!(!failed(retry_in).contains("200 ms"));
        assert!(failed(None).ends_with("; not tried again"));
    }

    #[test]
    fn a_granted_interval_is_told_only_where_it_differs() {
        let opened = |o2t_ms, t2o_ms| Opened {
            o2t_api: Duration::from_millis(o2t_ms),
            t2o_api: Duration::from_millis(t2o_ms),
            config: ConfigPath::None,
            multicast: None,
        };
        let asked = Duration::from_micros(2_500);
        assert_eq!(
            other_interval(&opened(10, 10), asked).as_deref(),
            Some("asked for frames every 2.5 ms, granted every 10 ms")
        );
        assert_eq!(
            other_interval(&opened(10, 20), asked).as_deref(),
            Some(
                "asked for frames every 2.5 ms, granted every 10 ms to the robot and every 20 ms from it"
            )
        );
        assert_eq!(other_interval(&opened(10, 10), Duration::from_millis(10)), None);
    }
}
