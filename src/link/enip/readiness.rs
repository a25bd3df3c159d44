//! Waiting for many sockets at once, to the nanosecond.
