// The image plug-in as bytes: from ln_image_plugin_begin up to ln_image_plugin_end.
  .section .rodata
  .balign 16
  .global ln_image_plugin_begin
  .global ln_image_plugin_end
  .hidden ln_image_plugin_begin
  .hidden ln_image_plugin_end
ln_image_plugin_begin:
  .incbin LN_IMAGE_PLUGIN_PATH
ln_image_plugin_end:
  .byte 0
  .section .note.GNU-stack, "", %progbits
