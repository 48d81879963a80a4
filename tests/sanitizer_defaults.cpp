// Leaks inside libraries that AddressSanitizer's leak check would report against us; nothing of ours is ever listed.
#if defined(__SANITIZE_ADDRESS__)

extern "C" const char* __lsan_default_suppressions();

// OpenImageIO 2.4 fetches its own error text inside a libpng callback, which libpng leaves by longjmp: the string of a
// truncated PNG is never freed. It also keeps each thread's last error message beyond the thread's end.
extern "C" const char* __lsan_default_suppressions() {
  return "leak:ImageInput::geterror\n";
}

#endif
