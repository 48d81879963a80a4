// Leaks inside libraries that AddressSanitizer's leak check would report against us; nothing of ours is ever listed.
#if defined(__SANITIZE_ADDRESS__)

extern "C" const char* __lsan_default_suppressions();

// OpenImageIO 2.4 keeps each thread's last error message of an ImageInput in thread-local storage that is not freed
// when the thread ends.
extern "C" const char* __lsan_default_suppressions() {
  return "leak:OpenImageIO_v2_4::ImageInput::geterror\n";
}

#endif
