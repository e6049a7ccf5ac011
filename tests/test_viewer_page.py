"""The built pages in a real browser."""


def test_the_browser_draws_webgl2(browser):
    page = browser.new_page()
    assert page.evaluate("document.createElement('canvas').getContext('webgl2') !== null")
    page.close()
