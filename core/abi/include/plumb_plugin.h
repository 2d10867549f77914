/* plumb_plugin.h - the contract between plumb and a plugin, version 1.1.
 *
 * A plugin is a shared library that drives one kind of device. It is loaded by a host process of its own, one per device; it may block in a
 * call, and if it crashes or hangs it takes nothing with it but that process. Beside the library lies its manifest, plugin.yaml.
 *
 * The library has one symbol: a constant struct plumb_entry named plumb_plugin_ and the library's own name, so libarm.so has plumb_plugin_arm
 * (PLUMB_PLUGIN_ENTRY(arm) below).
 *
 * Threads.    The host calls create, every function of an extension, and destroy one at a time, all from one and the same thread. The plugin
 *             may have threads of its own. Every function of plumb_host_functions may be called from any thread, except where said.
 * Ownership.  What a side allocates that side frees. Pointers given to a call are valid until it returns, except where said.
 * Errors.     A call that fails says why with host->fail and returns a status. It must not unwind, longjmp out, exit or abort.
 * Time.       ns of the cell's clock: CLOCK_MONOTONIC, or the clock of a simulated world.
 * Units.      rad, mm, s. A joint's numbers are rad, or mm where its description says so.
 * Growth.     A host loads plugins of its own major version and any minor version. Tables grow at their end only: look at `size` before using
 *             a field that a later minor version added. What is new and optional gets a new extension name.
 */
#ifndef PLUMB_PLUGIN_H
#define PLUMB_PLUGIN_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifndef PLUMB_MAGIC /* a test may want a library that is not quite a plugin */
#define PLUMB_MAGIC { 'P', 'L', 'U', 'M', 'B', 'P', 'L', 'G' }
#endif
#ifndef PLUMB_CONTRACT_MAJOR
#define PLUMB_CONTRACT_MAJOR 1u
#endif
#define PLUMB_CONTRACT_MINOR 1u

/* ---- How a call ended ------------------------------------------------------------------------------------------------------------- */

typedef int32_t plumb_status;
enum {
    PLUMB_OK = 0,
    PLUMB_FAILED = 1,        /* any failure without a status of its own */
    PLUMB_REFUSED = 2,       /* the configuration or an argument cannot be used; say what would be right */
    PLUMB_OUT_OF_RANGE = 3,  /* a move would leave the robot's range; nothing moved */
    PLUMB_UNSUPPORTED = 4,   /* the device cannot do this at all */
    PLUMB_STOPPED = 5,       /* a stop ended the call; the robot is at rest */
    PLUMB_NOT_READY = 6,     /* the device is not in a state that allows it */
    PLUMB_DISCONNECTED = 7,  /* the device does not answer */
    PLUMB_TIMED_OUT = 8,     /* it took longer than it may */
    PLUMB_INPUT_LOST = 9,    /* messages of a wired input were lost */
    PLUMB_PANICKED = 10,     /* a fault in the plugin's code was caught; used by plugins in Rust */
    PLUMB_EMPTY = 11         /* nothing yet; not an error */
};

/* Bytes lent for the length of a call. Text is UTF-8 without a final zero. */
typedef struct plumb_bytes {
    const uint8_t *data; /* may be NULL when length is 0 */
    size_t length;
} plumb_bytes;

/* Where a plugin writes an answer of any length. write may be called several times during the call the sink was given to, on its thread; the
 * pieces are joined. */
typedef struct plumb_sink {
    void *context; /* hand it back to write */
    void (*write)(void *context, plumb_bytes piece);
} plumb_sink;

/* ---- Messages: aligned to 8, no hidden padding, reserved fields zero ---------------------------------------------------------------- */

#define PLUMB_MAX_JOINTS 8

typedef struct plumb_joint_vector {
    uint32_t count; /* how many values are in use; the rest are zero */
    uint32_t reserved;
    double values[PLUMB_MAX_JOINTS];
} plumb_joint_vector;

/* Every message of a stream begins with time_ns and sequence. The host writes the sequence when the message is emitted. */

typedef struct plumb_joint_state { /* "joint-state/1" */
    uint64_t time_ns;
    uint64_t sequence;
    uint32_t moving; /* 1 while moving, 0 at rest */
    uint32_t reserved;
    plumb_joint_vector joints;
} plumb_joint_state;

typedef struct plumb_digital_inputs { /* "digital-inputs/1" */
    uint64_t time_ns;
    uint64_t sequence;
    uint64_t levels;  /* bit n: the level of line n */
    uint64_t changed; /* bit n: line n changed with this message */
    plumb_joint_vector joints;            /* where the robot was at that moment */
    plumb_joint_vector joints_half_width; /* known to within this, each way */
} plumb_digital_inputs;

typedef struct plumb_proximity_edge { /* "proximity-edge/1" */
    uint64_t time_ns;
    uint64_t sequence;
    uint32_t fired; /* 1: came on, 0: went off */
    uint32_t reserved;
    plumb_joint_vector joints;
    plumb_joint_vector joints_half_width;
} plumb_proximity_edge;

typedef struct plumb_motion {
    plumb_joint_vector target; /* where to, or by how much */
    uint32_t joint_mask;       /* bit n: joint n takes part; the others stay */
    uint32_t relative;         /* 1: target is added to where the joints are */
    double speed_fraction;     /* of the full speed of the slowest joint: above 0, at most 1 */
} plumb_motion;

typedef struct plumb_jog_state {
    plumb_joint_state state;
    uint32_t key;      /* the key pressed last, in the device's numbering; 0 when none */
    uint32_t finished; /* 1 once the operator has ended the jog on the pendant */
} plumb_jog_state;

/* What the motor of each joint reports of itself: a number for each joint. NAN of math.h stands for what a motor does not report and for an
 * uncertainty that is not known; 0 never does. */
typedef struct plumb_motor_state {
    uint64_t time_ns; /* when the motors reported this */
    plumb_joint_vector temperature; /* degrees Celsius */
    plumb_joint_vector load;        /* of the motor's full torque, without a sign: from 0; 1 is full */
    plumb_joint_vector voltage;     /* the motor's supply, V */
    double temperature_uncertainty; /* one standard uncertainty of each temperature, degrees Celsius */
    double load_uncertainty;        /* of each load */
    double voltage_uncertainty;     /* of each voltage, V */
} plumb_motor_state;

/* ---- What the host offers a plugin -------------------------------------------------------------------------------------------------- */

enum { PLUMB_LOG_ERROR = 0, PLUMB_LOG_WARNING = 1, PLUMB_LOG_INFO = 2, PLUMB_LOG_DEBUG = 3 };

/* Given to create. The table and its context stay until the process ends. context is every function's first argument. Any thread. */
typedef struct plumb_host_functions {
    uint32_t size; /* of this struct, as the host knows it */
    uint32_t contract_minor;
    void *context;

    /* Writes a line to the log, under the request being served. The text is copied; beyond 4096 bytes it is cut. Lines that come faster than 500
     * a second for long are left out and counted. What the plugin prints to stdout and stderr goes to the log as well, at once and in the same way,
     * 20 lines a second. */
    void (*log)(void *context, uint32_t level, plumb_bytes text);

    /* Says why the call that is about to return another status than PLUMB_OK failed. The text is copied; the last one counts. */
    void (*fail)(void *context, plumb_bytes text);

    /* The time of the cell's clock, ns, with which everything in the cell is dated: CLOCK_MONOTONIC, except in a cell with a simulated world that runs
     * faster than the wall, where it is that world's time and is stopped while nothing moves. Do not measure time limits with it. */
    uint64_t (*now_ns)(void *context);

    /* 1 when a stop has been asked for, else 0. A call that takes long looks at least every 50 ms, brings the device to rest and returns
     * PLUMB_STOPPED. It stays 1 until the device is activated again. */
    uint32_t (*should_stop)(void *context);

    /* Emits a message on one of the manifest's streams. The message is copied. PLUMB_REFUSED for a stream that is not in the manifest, a
     * length that is not its layout's, or one that is not a multiple of 8. */
    plumb_status (*emit)(void *context, plumb_bytes stream, plumb_bytes message);

    /* Lends length bytes of shared memory, aligned to 8, to build a large message in; written to *message. One at a time, and publish follows
     * on the same thread. */
    plumb_status (*loan)(void *context, plumb_bytes stream, size_t length, uint8_t **message);

    /* Emits what was lent (send 1) or gives it back (send 0). Afterwards the pointer is no longer the plugin's. */
    plumb_status (*publish)(void *context, uint8_t *message, uint32_t send);

    /* Copies the next message of an input that the cell file wires to message, and its length to *length. PLUMB_EMPTY when none waits;
     * PLUMB_INPUT_LOST once when messages were lost, then goes on with what is there; PLUMB_REFUSED for an input that is not wired or a
     * message longer than capacity. */
    plumb_status (*receive)(void *context, plumb_bytes input, uint8_t *message, size_t capacity, size_t *length);

    /* Reports how far a long call has come: fraction from 0 to 1, and what it does now. */
    void (*progress)(void *context, double fraction, plumb_bytes text);
} plumb_host_functions;

/* ---- The plugin's one symbol -------------------------------------------------------------------------------------------------------- */

typedef struct plumb_instance plumb_instance; /* a device as the plugin knows it */

typedef struct plumb_entry {
    uint8_t magic[8]; /* PLUMB_MAGIC */
    uint32_t contract_major; /* PLUMB_CONTRACT_MAJOR */
    uint32_t contract_minor; /* PLUMB_CONTRACT_MINOR */
    uint32_t size; /* sizeof(plumb_entry) */
    uint32_t reserved; /* 0 */

    /* The text of plugin.yaml, the same as in the file beside the library. Constant. */
    plumb_bytes manifest;

    /* Connects to a device; nothing moves. config is the JSON of what the cell file gives under `config:`, or null. On PLUMB_OK *instance is
     * the device, the plugin's until destroy; on anything else it is left alone. */
    plumb_status (*create)(const plumb_host_functions *host, plumb_bytes config, plumb_instance **instance);

    /* Ends a device and frees what belongs to it. No thread of the plugin may use it afterwards. */
    void (*destroy)(plumb_instance *instance);

    /* The functions of a name such as "plumb.robot/1", or NULL. The table is constant. */
    const void *(*extension)(plumb_bytes name);
} plumb_entry;

#if defined(__GNUC__)
#define PLUMB_EXPORT __attribute__((visibility("default")))
#else
#define PLUMB_EXPORT
#endif
#define PLUMB_PLUGIN_ENTRY(library) PLUMB_EXPORT extern const plumb_entry plumb_plugin_##library; const plumb_entry plumb_plugin_##library

/* ---- A robot: extension "plumb.robot/1" --------------------------------------------------------------------------------------------- */

/* A robot emits the streams "joints" (plumb_joint_state, while it moves and when it comes to rest) and, with input lines, "inputs"
 * (plumb_digital_inputs, at every change, and one with changed = 0 at the end of every move, whose time_ns is not before that of the state
 * the move returns).
 *
 * A sensor that is wired to these streams is asked for what it has seen up to the moment of a reading. So after read_joints at rest there has to
 * be a message on each that is not older than the state it wrote. A robot need not emit them: where it has not, the host emits that state on
 * "joints", and what read_inputs then says on "inputs". A robot with input lines therefore has read_inputs.
 *
 * Every time_ns is taken from now_ns (or the simulated world's clock) when the value was measured; it is never 0 and never the time of day.
 * The joints a move returns are where the robot is, at rest: whoever asked compares them with the target.
 *
 * NULL means a function the robot does not have; describe, read_joints, move_joints and stop must be there. */
typedef struct plumb_robot_functions {
    uint32_t size; /* sizeof(plumb_robot_functions) */
    uint32_t reserved;

    /* Writes the description as JSON: {"model", "joints": [{"name", "unit": "rad"|"mm", "lower", "upper", "resolution", "max_speed",
     * "home"}], "inputs": [{"name", "bit"}], "outputs": [...], "capabilities": {"interruptible", "stop_time_ms", "jog", "only_pendant_ends_jog",
     * "set_zero"}}. */
    plumb_status (*describe)(plumb_instance *instance, const plumb_sink *answer);

    /* Makes ready to move. Clears an earlier stop. */
    plumb_status (*activate)(plumb_instance *instance);

    /* Brings to rest so that the robot may be left alone. */
    plumb_status (*deactivate)(plumb_instance *instance);

    /* Where the joints are now; within 5 s. */
    plumb_status (*read_joints)(plumb_instance *instance, plumb_joint_state *state);

    /* Moves; writes the state in which the robot came to rest. The host has checked the limits. Looks at should_stop every 50 ms. */
    plumb_status (*move_joints)(plumb_instance *instance, const plumb_motion *motion, plumb_joint_state *state);

    /* Brings to rest, now; called after a move was interrupted and when none was under way. */
    plumb_status (*stop)(plumb_instance *instance);

    /* The input lines now. */
    plumb_status (*read_inputs)(plumb_instance *instance, plumb_digital_inputs *inputs);

    /* Sets the output lines: bit n is the level of line n. */
    plumb_status (*write_outputs)(plumb_instance *instance, uint64_t levels);

    /* Hands the robot to its pendant (1) or takes it back (0), and reports where it is. Called again and again while the operator drives. */
    plumb_status (*jog)(plumb_instance *instance, uint32_t on, plumb_jog_state *state);

    /* Declares that the joints are at `joints` now. Nothing moves. */
    plumb_status (*set_zero)(plumb_instance *instance, const plumb_joint_vector *joints);

    /* What the motor of each joint reports of itself: temperature, load, supply voltage. Nothing moves. Since contract 1.1. */
    plumb_status (*read_motors)(plumb_instance *instance, plumb_motor_state *motors);
} plumb_robot_functions;

/* ---- A sensor: extension "plumb.sensor/1" ------------------------------------------------------------------------------------------- */

/* NULL means a function the sensor does not have; describe and read must be there. */
typedef struct plumb_sensor_functions {
    uint32_t size; /* sizeof(plumb_sensor_functions) */
    uint32_t reserved;

    /* Writes the description as JSON: {"model", "switches": true|false, "quantities": [{"name", "unit"}]}. */
    plumb_status (*describe)(plumb_instance *instance, const plumb_sink *answer);

    /* Changes settings while running: JSON, only the keys to be changed. */
    plumb_status (*configure)(plumb_instance *instance, plumb_bytes settings);

    /* Forgets what was seen so far and watches from now on. */
    plumb_status (*arm)(plumb_instance *instance);

    /* Takes in what has come: called when a wired input has messages. An error is returned by the next read. */
    plumb_status (*poll)(plumb_instance *instance);

    /* Writes what was seen since the last reading, with every quantity of the description, within 5 s or the manifest's read_time_limit_s, and
     * not older than after_ns, as JSON: {"time_ns", "fired", "edges": [{"time_ns", "sequence", "fired", "joints": [...],
     * "joints_half_width": [...]}], "quantities": [{"name", "value", "standard_uncertainty"}]}. PLUMB_EMPTY when the inputs have not been
     * seen up to after_ns: the host takes in more and asks again. */
    plumb_status (*read)(plumb_instance *instance, uint64_t after_ns, const plumb_sink *answer);
} plumb_sensor_functions;

#ifdef __cplusplus
}
#endif

#endif
