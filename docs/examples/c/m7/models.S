/* The learned models' files as they are, data that can be replaced. The assembler finds them by -Wa,-I. */
    .section .rodata.models, "a"
    .global model_euler, model_euler_end, model_rk4, model_rk4_end
model_euler:
    .incbin "euler.model"
model_euler_end:
model_rk4:
    .incbin "rk4.model"
model_rk4_end:
#ifdef __linux__
    .section .note.GNU-stack, "", %progbits
#endif
