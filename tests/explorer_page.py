"""What the tests of the explorer in a browser ask of its page."""

FRAME = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


def facts(browser):
    browser.run(FRAME)
    return browser.run("document.getElementById('facts').textContent")


def settled(browser):
    """The same once the exponent has come too."""
    browser.run(FRAME)
    browser.wait("!document.getElementById('facts').textContent.includes('computing')")
    return facts(browser)


def swept(browser):
    browser.wait("explorer.swept[0] === 300 && explorer.swept[1] === 300")


def drawn(browser, panel):
    """How many pixels of a panel are not empty."""
    return browser.run(
        f"""(() => {{ const canvas = document.querySelector('#{panel} canvas.base');
        const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
        let count = 0; for (let i = 3; i < data.length; i += 4) count += data[i] > 0; return count; }})()"""
    )
