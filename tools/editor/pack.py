#!/usr/bin/env python3
"""Packs the extension: a VSIX is a zip with a manifest, which is made from package.json.

Usage: pack.py OUTPUT.vsix SOURCE_FOLDER BUILD_FOLDER
The same files give the same bytes: names are sorted, and times are that of nothing.
"""
import json
import pathlib
import sys
import zipfile
from xml.sax.saxutils import escape, quoteattr

CONTENT_TYPES = '''<?xml version="1.0" encoding="utf-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
<Default Extension=".json" ContentType="application/json"/><Default Extension=".js" ContentType="application/javascript"/>
<Default Extension=".md" ContentType="text/markdown"/><Default Extension=".txt" ContentType="text/plain"/>
<Default Extension=".vsixmanifest" ContentType="text/xml"/>
</Types>
'''


def manifest(package):
    return f'''<?xml version="1.0" encoding="utf-8"?>
<PackageManifest Version="2.0.0" xmlns="http://schemas.microsoft.com/developer/vsx-schema/2011">
<Metadata>
<Identity Language="en-US" Id={quoteattr(package['name'])} Version={quoteattr(package['version'])} Publisher={quoteattr(package['publisher'])}/>
<DisplayName>{escape(package['displayName'])}</DisplayName>
<Description xml:space="preserve">{escape(package['description'])}</Description>
<Tags>{escape(','.join(package['keywords']))}</Tags>
<Categories>{escape(','.join(package['categories']))}</Categories>
<GalleryFlags>Public</GalleryFlags>
<Properties><Property Id="Microsoft.VisualStudio.Code.Engine" Value={quoteattr(package['engines']['vscode'])}/></Properties>
<License>extension/LICENSE.txt</License>
</Metadata>
<Installation><InstallationTarget Id="Microsoft.VisualStudio.Code"/></Installation>
<Dependencies/>
<Assets>
<Asset Type="Microsoft.VisualStudio.Code.Manifest" Path="extension/package.json" Addressable="true"/>
<Asset Type="Microsoft.VisualStudio.Services.Content.Details" Path="extension/README.md" Addressable="true"/>
<Asset Type="Microsoft.VisualStudio.Services.Content.License" Path="extension/LICENSE.txt" Addressable="true"/>
</Assets>
</PackageManifest>
'''


def main():
    output, source, build = map(pathlib.Path, sys.argv[1:4])
    root = source.parents[1]
    package = json.loads((source / 'package.json').read_text())
    files = {'[Content_Types].xml': CONTENT_TYPES, 'extension.vsixmanifest': manifest(package)}
    for name in ('package.json', *(path.name for path in sorted(source.glob('*.tmLanguage.json'))),
                 *(path.name for path in sorted(source.glob('*.configuration.json')))):
        files['extension/' + name] = (source / name).read_text()
    for name in ('extension.js', 'licenses.txt'):
        files['extension/' + name] = (build / name).read_text()
    files['extension/README.md'] = (root / 'docs' / 'editor.md').read_text()
    files['extension/LICENSE.txt'] = (root / 'LICENSE').read_text()
    temporary = output.with_suffix('.partial')
    output.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(temporary, 'w', zipfile.ZIP_DEFLATED) as archive:
        for name, text in sorted(files.items()):
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), text, zipfile.ZIP_DEFLATED)
    temporary.rename(output)


if __name__ == '__main__':
    main()
