"""tap.py: runs tests that are functions and reports them as TAP."""


def run(tests, *arguments):
    """Calls each test with the arguments; one that raises has failed. Returns the program's exit status."""
    failed = 0
    print(f"1..{len(tests)}")
    for number, test in enumerate(tests, 1):
        try:
            test(*arguments)
            print(f"ok {number} - {test.__name__}", flush=True)
        except Exception as error:  # a test's failure, of any kind
            failed = 1
            for line in f"{type(error).__name__}: {error}".splitlines():
                print("#", line[:1000])
            print(f"not ok {number} - {test.__name__}", flush=True)
    return failed
