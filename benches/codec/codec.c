/* What a C programmer writes by hand for the two images; compiled by the bench with cc -O2. */

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#define ALWAYS_INLINE static inline __attribute__((always_inline))

ALWAYS_INLINE uint16_t get16(const uint8_t *p, bool big)
{
    return big ? (uint16_t)(p[0] << 8 | p[1]) : (uint16_t)(p[1] << 8 | p[0]);
}

ALWAYS_INLINE uint32_t get32(const uint8_t *p, bool big)
{
    uint32_t v;
    memcpy(&v, p, 4);
    return big == (__BYTE_ORDER__ == __ORDER_BIG_ENDIAN__) ? v : __builtin_bswap32(v);
}

ALWAYS_INLINE float get_real(const uint8_t *p, bool big)
{
    uint32_t bits = get32(p, big);
    float v;
    memcpy(&v, &bits, 4);
    return v;
}

ALWAYS_INLINE void put16(uint8_t *p, uint16_t v, bool big)
{
    p[big ? 0 : 1] = (uint8_t)(v >> 8);
    p[big ? 1 : 0] = (uint8_t)v;
}

ALWAYS_INLINE void put32(uint8_t *p, uint32_t v, bool big)
{
    if (big != (__BYTE_ORDER__ == __ORDER_BIG_ENDIAN__))
        v = __builtin_bswap32(v);
    memcpy(p, &v, 4);
}

ALWAYS_INLINE void put_real(uint8_t *p, float v, bool big)
{
    uint32_t bits;
    memcpy(&bits, &v, 4);
    put32(p, bits, big);
}

struct pose {
    float x, y, z, alpha, beta, gamma;
};

struct safety_bits {
    bool e_stop, p_stop1, p_stop2, operation_mode_change, enabling_device_released,
        voltage_fluctuation, reboot, redundancy_fault, standstill_fault, connection_dropped,
        minor_error;
};

struct dynamic_slot {
    uint32_t dynamic_type;
    float value_idx[6];
};

struct input_values {
    bool busy, activated, homed, sim_activated, brakes_engaged, recovery_mode, e_stop,
        collision_status, work_zone_status, monitoring_mode;
    uint16_t error_code;
    uint16_t checkpoint_reached, checkpoint_discarded, move_id, fifo_space;
    bool paused, eob, eom, cleared, p_stop2, excessive_torque;
    uint16_t offline_program_id;
    float joint[6];
    struct pose target_end_effector_pose;
    int8_t shoulder, elbow, wrist, turn;
    struct pose target_wrf, target_trf;
    uint32_t seconds, microseconds, dynamic_data_cycles;
    struct safety_bits signals, resettable;
    uint8_t operation_mode;
    bool reset_ready, v_motor_on;
    bool psu_e_stop, psu_p_stop1, psu_p_stop2, psu_reset_external, psu_reset_keypad,
        psu_enabling_device;
    struct dynamic_slot dynamic_data[4];
};

ALWAYS_INLINE void get_pose(const uint8_t *p, struct pose *v, bool big)
{
    v->x = get_real(p, big);
    v->y = get_real(p + 4, big);
    v->z = get_real(p + 8, big);
    v->alpha = get_real(p + 12, big);
    v->beta = get_real(p + 16, big);
    v->gamma = get_real(p + 20, big);
}

ALWAYS_INLINE void get_safety_bits(const uint8_t *p, struct safety_bits *v)
{
    v->e_stop = p[0] & 1;
    v->p_stop1 = p[0] >> 1 & 1;
    v->p_stop2 = p[0] >> 2 & 1;
    v->operation_mode_change = p[0] >> 4 & 1;
    v->enabling_device_released = p[0] >> 5 & 1;
    v->voltage_fluctuation = p[0] >> 6 & 1;
    v->reboot = p[0] >> 7 & 1;
    v->redundancy_fault = p[1] & 1;
    v->standstill_fault = p[1] >> 1 & 1;
    v->connection_dropped = p[1] >> 2 & 1;
    v->minor_error = p[1] >> 3 & 1;
}

ALWAYS_INLINE void decode(const uint8_t *restrict p, struct input_values *restrict v, bool big)
{
    v->busy = p[0] & 1;
    v->activated = p[0] >> 1 & 1;
    v->homed = p[0] >> 2 & 1;
    v->sim_activated = p[0] >> 3 & 1;
    v->brakes_engaged = p[0] >> 4 & 1;
    v->recovery_mode = p[0] >> 5 & 1;
    v->e_stop = p[0] >> 6 & 1;
    v->collision_status = p[0] >> 7 & 1;
    v->work_zone_status = p[1] & 1;
    v->monitoring_mode = p[1] >> 1 & 1;
    v->error_code = get16(p + 2, big);
    v->checkpoint_reached = get16(p + 4, big);
    v->checkpoint_discarded = get16(p + 6, big);
    v->move_id = get16(p + 8, big);
    v->fifo_space = get16(p + 10, big);
    v->paused = p[12] & 1;
    v->eob = p[12] >> 1 & 1;
    v->eom = p[12] >> 2 & 1;
    v->cleared = p[12] >> 3 & 1;
    v->p_stop2 = p[12] >> 4 & 1;
    v->excessive_torque = p[12] >> 5 & 1;
    v->offline_program_id = get16(p + 14, big);
    for (int i = 0; i < 6; i++)
        v->joint[i] = get_real(p + 16 + 4 * i, big);
    get_pose(p + 40, &v->target_end_effector_pose, big);
    v->shoulder = (int8_t)p[64];
    v->elbow = (int8_t)p[65];
    v->wrist = (int8_t)p[66];
    v->turn = (int8_t)p[67];
    get_pose(p + 68, &v->target_wrf, big);
    get_pose(p + 92, &v->target_trf, big);
    v->seconds = get32(p + 116, big);
    v->microseconds = get32(p + 120, big);
    v->dynamic_data_cycles = get32(p + 124, big);
    get_safety_bits(p + 128, &v->signals);
    get_safety_bits(p + 132, &v->resettable);
    v->operation_mode = p[136];
    v->reset_ready = p[137] & 1;
    v->v_motor_on = p[137] >> 1 & 1;
    v->psu_e_stop = p[138] & 1;
    v->psu_p_stop1 = p[138] >> 1 & 1;
    v->psu_p_stop2 = p[138] >> 2 & 1;
    v->psu_reset_external = p[138] >> 3 & 1;
    v->psu_reset_keypad = p[138] >> 4 & 1;
    v->psu_enabling_device = p[138] >> 5 & 1;
    for (int slot = 0; slot < 4; slot++) {
        const uint8_t *from = p + 140 + 28 * slot;
        v->dynamic_data[slot].dynamic_type = get32(from, big);
        for (int i = 0; i < 6; i++)
            v->dynamic_data[slot].value_idx[i] = get_real(from + 4 + 4 * i, big);
    }
}

void measured_c_decode_big(const uint8_t *p, struct input_values *v) { decode(p, v, true); }
void measured_c_decode_little(const uint8_t *p, struct input_values *v) { decode(p, v, false); }

struct output_values {
    bool deactivate_robot, activate_robot, home, reset_error, activate_sim, enable_recovery_mode,
        disable_ethercat;
    uint16_t move_id;
    bool set_point, pause_motion, clear_motion, resume_motion, use_variables;
    uint32_t motion_command_id;
    float argument[6];
    uint32_t host_time;
    bool brakes_control_allowed, brakes_engaged;
    uint32_t dynamic_data_type_id[4];
};

ALWAYS_INLINE void encode(const struct output_values *restrict v, uint8_t *restrict p, bool big)
{
    p[0] = (uint8_t)(v->deactivate_robot | v->activate_robot << 1 | v->home << 2 |
                     v->reset_error << 3 | v->activate_sim << 4 | v->enable_recovery_mode << 5 |
                     v->disable_ethercat << 6);
    p[1] = p[2] = p[3] = 0;
    put16(p + 4, v->move_id, big);
    p[6] = (uint8_t)(v->set_point | v->pause_motion << 1 | v->clear_motion << 2 |
                     v->resume_motion << 3 | v->use_variables << 4);
    p[7] = 0;
    put32(p + 8, v->motion_command_id, big);
    for (int i = 0; i < 6; i++)
        put_real(p + 12 + 4 * i, v->argument[i], big);
    put32(p + 36, v->host_time, big);
    p[40] = (uint8_t)(v->brakes_control_allowed | v->brakes_engaged << 1);
    p[41] = p[42] = p[43] = 0;
    for (int i = 0; i < 4; i++)
        put32(p + 44 + 4 * i, v->dynamic_data_type_id[i], big);
}

void measured_c_encode_big(const struct output_values *v, uint8_t *p) { encode(v, p, true); }
void measured_c_encode_little(const struct output_values *v, uint8_t *p) { encode(v, p, false); }

/* What a controller looks at in each bus cycle. */
struct cycle_reads {
    uint16_t status_bits, error_code, checkpoint_reached, checkpoint_discarded, move_id,
        fifo_space, motion_bits;
    uint32_t seconds, microseconds;
    uint32_t signal_bits, resettable_bits;
    uint32_t dynamic_types[4];
};

ALWAYS_INLINE void read_cycle(const uint8_t *restrict p, struct cycle_reads *restrict v, bool big)
{
    v->status_bits = get16(p, false);
    v->error_code = get16(p + 2, big);
    v->checkpoint_reached = get16(p + 4, big);
    v->checkpoint_discarded = get16(p + 6, big);
    v->move_id = get16(p + 8, big);
    v->fifo_space = get16(p + 10, big);
    v->motion_bits = get16(p + 12, false);
    v->seconds = get32(p + 116, big);
    v->microseconds = get32(p + 120, big);
    v->signal_bits = get32(p + 128, false);
    v->resettable_bits = get32(p + 132, false);
    for (int i = 0; i < 4; i++)
        v->dynamic_types[i] = get32(p + 140 + 28 * i, big);
}

void measured_c_reads_big(const uint8_t *p, struct cycle_reads *v) { read_cycle(p, v, true); }
void measured_c_reads_little(const uint8_t *p, struct cycle_reads *v) { read_cycle(p, v, false); }
