// The checksum of a plan: 64-bit FNV-1a over the bits of its rows, in the order of core/src/planner/record.rs.

const MASK = (1n << 64n) - 1n;
const PRIME = 0x100000001b3n;

/** 16 hexadecimal digits. */
export const hexadecimal = (number) => number.toString(16).padStart(16, "0");

/** The checksum of a plan as its file has it. */
export function checksumOf({ stage1, stage2 }) {
  const rows = [
    stage1.position_rtn_m,
    stage1.velocity_rtn_m_s,
    stage1.force_rtn_n,
    stage2.attitude_body_to_rtn,
    stage2.joint_angle_rad,
    stage2.rate_rtn_rad_s,
    stage2.joint_rate_rad_s,
    stage2.bus_torque_body_n_m,
    stage2.joint_torque_n_m,
  ];
  const numbers = rows.flat(2);
  const bytes = new DataView(new ArrayBuffer(8 * numbers.length));
  numbers.forEach((number, i) => bytes.setFloat64(8 * i, number, true));
  let sum = 0xcbf29ce484222325n;
  for (let i = 0; i < bytes.byteLength; i++) {
    sum = ((sum ^ BigInt(bytes.getUint8(i))) * PRIME) & MASK;
  }
  return hexadecimal(sum);
}
