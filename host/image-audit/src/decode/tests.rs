//! Every kind of branch, as an assembler encodes it and an independent disassembler reads it back.

use super::*;

/// Where the code of a case begins: not at zero, so that an address is told from an offset.
const BASE: u64 = 0x10000;

/// Effect of an instruction in a case; targets are relative to its beginning.
#[derive(Clone, Copy)]
enum Is {
    Nothing,
    Call(i64),
    Jump(i64),
    Through(i64),
    IndirectCall,
    IndirectJump,
    TableJump,
}
use Is::*;

/// Decodes the instructions of a case, given by their bytes, and compares all there is.
fn check(machine: Machine, case: &[(&[u8], Is)]) -> Decoded {
    let mut code = Vec::new();
    let mut expected = Vec::new();
    for (bytes, is) in case {
        let at = BASE + code.len() as u64;
        code.extend_from_slice(bytes);
        let to = |offset: i64| BASE.wrapping_add_signed(offset);
        let flow = match *is {
            Nothing => continue,
            Call(offset) => Flow::Call(to(offset)),
            Jump(offset) => Flow::Jump(to(offset)),
            Through(offset) => Flow::Through(to(offset)),
            IndirectCall => Flow::IndirectCall,
            IndirectJump => Flow::IndirectJump,
            TableJump => Flow::TableJump,
        };
        expected.push(Transfer { at, flow });
    }
    let decoded = decode(machine, &code, BASE);
    assert_eq!(decoded.transfers, expected);
    decoded
}

#[test]
fn thumb() {
    check(
        Machine::Arm,
        &[
            (&[0x00, 0xbf], Nothing),                  // nop
            (&[0xff, 0xf7, 0xfd, 0xff], Call(0)),      // bl
            (&[0x00, 0xf0, 0x28, 0xf8], Call(0x5a)),   // bl
            (&[0xff, 0xf7, 0xf9, 0xbf], Jump(0)),      // b.w
            (&[0x3f, 0xf4, 0xf7, 0xaf], Jump(0)),      // beq.w
            (&[0x00, 0xf2, 0x22, 0x80], Jump(0x5a)),   // bhi.w
            (&[0xf3, 0xd1], Jump(0)),                  // bne
            (&[0x1f, 0xe0], Jump(0x5a)),               // b
            (&[0xf0, 0xb1], Jump(0x5a)),               // cbz
            (&[0xeb, 0xb9], Jump(0x5a)),               // cbnz
            (&[0x98, 0x47], IndirectCall),             // blx r3
            (&[0x70, 0x47], Nothing),                  // bx lr
            (&[0x10, 0x47], IndirectJump),             // bx r2
            (&[0x97, 0x46], IndirectJump),             // mov pc, r2
            (&[0xf7, 0x46], Nothing),                  // mov pc, lr
            (&[0xdf, 0xe8, 0x00, 0xf0], TableJump),    // tbb [pc, r0]
            (&[0xdf, 0xe8, 0x10, 0xf0], TableJump),    // tbh [pc, r0, lsl #1]
            (&[0xd0, 0xf8, 0x00, 0xf0], IndirectJump), // ldr.w pc, [r0]
            (&[0x50, 0xf8, 0x21, 0xf0], IndirectJump), // ldr.w pc, [r0, r1, lsl #2]
            (&[0x5d, 0xf8, 0x04, 0xfb], Nothing),      // ldr pc, [sp], #4
            (&[0x10, 0xbd], Nothing),                  // pop {r4, pc}
            (&[0xbd, 0xe8, 0x10, 0x81], Nothing),      // pop.w {r4, r8, pc}
            (&[0xb0, 0xe8, 0x02, 0x80], IndirectJump), // ldm.w r0!, {r1, pc}
            (&[0x01, 0xdf], Nothing),                  // svc #1
            (&[0x02, 0xde], Nothing),                  // udf #2
            (&[0xbf, 0xf3, 0x5f, 0x8f], Nothing),      // dmb sy
            (&[0xef, 0xf3, 0x14, 0x80], Nothing),      // mrs r0, control
            (&[0x80, 0xf3, 0x14, 0x88], Nothing),      // msr control, r0
            (&[0xdf, 0xf8, 0x04, 0x00], Nothing),      // ldr.w r0, [pc, #4]
            (&[0xff, 0xf7, 0xd1, 0xff], Call(0)),      // bl
            (&[0xff, 0xf7, 0xfc, 0xbf], Jump(0x5a)),   // b.w
        ],
    );
}

#[test]
fn aarch64() {
    check(
        Machine::AArch64,
        &[
            (&[0x1f, 0x20, 0x03, 0xd5], Nothing),      // nop
            (&[0xff, 0xff, 0xff, 0x97], Call(0)),      // bl
            (&[0x0f, 0x00, 0x00, 0x14], Jump(0x44)),   // b
            (&[0xa1, 0xff, 0xff, 0x54], Jump(0)),      // b.ne
            (&[0x83, 0xff, 0xff, 0xb4], Jump(0)),      // cbz x3
            (&[0x84, 0x01, 0x00, 0x35], Jump(0x44)),   // cbnz w4
            (&[0x41, 0xff, 0x47, 0xb6], Jump(0)),      // tbz x1, #40
            (&[0x42, 0x01, 0x18, 0x37], Jump(0x44)),   // tbnz w2, #3
            (&[0x00, 0x01, 0x3f, 0xd6], IndirectCall), // blr x8
            (&[0xc0, 0x03, 0x5f, 0xd6], Nothing),      // ret
            (&[0x20, 0x01, 0x1f, 0xd6], IndirectJump), // br x9
            (&[0x29, 0x09, 0x0a, 0x8b], Nothing),      // add x9, x9, x10, lsl #2
            (&[0x20, 0x01, 0x1f, 0xd6], TableJump),    // br x9
            (&[0x29, 0x01, 0x0a, 0x8b], Nothing),      // add x9, x9, x10
            (&[0x00, 0x01, 0x1f, 0xd6], IndirectJump), // br x8
            (&[0x21, 0xfe, 0xff, 0x10], Nothing),      // adr x1
            (&[0xe0, 0x03, 0x9f, 0xd6], Nothing),      // eret
            (&[0xef, 0xff, 0xff, 0x17], Jump(0)),      // b
        ],
    );
}

#[test]
fn riscv() {
    check(
        Machine::RiscV64,
        &[
            (&[0x01, 0x00], Nothing),                  // c.nop
            (&[0xef, 0xf0, 0xff, 0xff], Call(0)),      // jal ra
            (&[0x6f, 0x00, 0x00, 0x05], Jump(0x56)),   // j
            (&[0xef, 0x02, 0xc0, 0x04], Call(0x56)),   // jal t0
            (&[0xe3, 0x09, 0xb5, 0xfe], Jump(0)),      // beq
            (&[0x63, 0x62, 0xb5, 0x04], Jump(0x56)),   // bltu
            (&[0x97, 0x10, 0x00, 0x00], Nothing),      // auipc ra, 1
            (&[0xe7, 0x80, 0x00, 0xff], Call(0x1006)), // jalr -16(ra)
            (&[0x17, 0xf3, 0xff, 0xff], Nothing),      // auipc t1, -1
            (&[0x67, 0x00, 0x03, 0x02], Jump(-0xfc2)), // jr 32(t1)
            (&[0x17, 0x05, 0x00, 0x00], Nothing),      // auipc a0, 0
            (&[0x13, 0x05, 0x85, 0x00], Nothing),      // addi a0, a0, 8
            (&[0xe7, 0x00, 0x05, 0x00], IndirectCall), // jalr a0
            (&[0x67, 0x80, 0x07, 0x00], IndirectJump), // jr a5
            (&[0x67, 0x80, 0x00, 0x00], Nothing),      // ret
            (&[0x67, 0x80, 0x02, 0x00], Nothing),      // jr t0
            (&[0x73, 0x00, 0x00, 0x00], Nothing),      // ecall
            (&[0x7d, 0xbf], Jump(0)),                  // c.j
            (&[0x09, 0xa8], Jump(0x56)),               // c.j
            (&[0x4d, 0xdd], Jump(0)),                  // c.beqz
            (&[0x99, 0xe5], Jump(0x56)),               // c.bnez
            (&[0x82, 0x80], Nothing),                  // c.jr ra
            (&[0x82, 0x87], IndirectJump),             // c.jr a5
            (&[0x82, 0x97], IndirectCall),             // c.jalr a5
            (&[0x02, 0x90], Nothing),                  // c.ebreak
            (&[0x2e, 0x85], Nothing),                  // c.mv
            (&[0x2e, 0x95], Nothing),                  // c.add
            (&[0x6d, 0xb7], Jump(0)),                  // c.j
        ],
    );
}

#[test]
fn x86_64() {
    let decoded = check(
        Machine::X86_64,
        &[
            (&[0x90], Nothing),                                          // nop
            (&[0xe8, 0xfa, 0xff, 0xff, 0xff], Call(0)),                  // call
            (&[0xeb, 0x35], Jump(0x3d)),                                 // jmp
            (&[0x75, 0xf6], Jump(0)),                                    // jne
            (&[0xeb, 0xf4], Jump(0)),                                    // jmp
            (&[0xff, 0xd0], IndirectCall),                               // call rax
            (&[0xff, 0x50, 0x18], IndirectCall),                         // call [rax + 24]
            (&[0xff, 0x15, 0x00, 0x01, 0x00, 0x00], Through(0x117)),     // call [rip + 256]
            (&[0xff, 0x25, 0x00, 0x01, 0x00, 0x00], Through(0x11d)),     // jmp [rip + 256]
            (&[0xff, 0xe0], IndirectJump),                               // jmp rax
            (&[0x48, 0x63, 0x04, 0x82], Nothing),                        // movsxd rax, [..]
            (&[0x48, 0x01, 0xd0], Nothing),                              // add rax, rdx
            (&[0xff, 0xe0], TableJump),                                  // jmp rax
            (&[0xff, 0x24, 0xc5, 0x00, 0x04, 0x00, 0x00], IndirectJump), // jmp [8 rax + 1024]
            (&[0x48, 0x8d, 0x3d, 0xca, 0xff, 0xff, 0xff], Nothing),      // lea rdi, [rip - 54]
            (&[0x48, 0x83, 0xe4, 0xc0], Nothing),                        // and rsp, -64
            (&[0xc3], Nothing),                                          // ret
            (&[0x0f, 0x0b], Nothing),                                    // ud2
            (&[0xcc], Nothing),                                          // int3
        ],
    );
    assert_eq!(decoded.references, [BASE + 0x117, BASE + 0x11d, BASE]);
    assert_eq!(decoded.realignment, 64 - 16);
    assert!(decoded.invalid.is_empty());
    assert_eq!(decode(Machine::X86_64, &[0x06], BASE).invalid, [BASE]);
}

#[test]
fn code_that_is_cut_short_ends_quietly() {
    for machine in [Machine::Arm, Machine::AArch64, Machine::RiscV64] {
        for code in [&[][..], &[0xff], &[0xff, 0xf7], &[0xef, 0xf0, 0xff]] {
            assert_eq!(decode(machine, code, BASE).transfers, []);
        }
    }
}
