function capsule_build(prefix, folder)
%CAPSULE_BUILD  Compile the gateways to the C library of a scene, in MATLAB and in Octave.
%   CAPSULE_BUILD(prefix) compiles CAPSULE_SIMULATE and CAPSULE_MANY beside this file against the C
%   library that `cmake --install` put under prefix. They hold the library: it may go afterwards.
%
%   CAPSULE_BUILD(prefix, folder) puts them into a folder, with their help texts. The library is that
%   of one scene: put those of several scenes into a folder each, and one of them on the path.
%
%   See also CAPSULE_SIMULATE, CAPSULE_MANY.
here = fileparts(mfilename('fullpath'));
if nargin < 2
    folder = here;
elseif ~isfolder(folder)
    mkdir(folder);
end
places = {{'lib*'}, {'lib*', '*'}};
library = [];
for k = 1:numel(places)
    for name = {'libcapsule.a', 'capsule_static.lib'}
        library = [library; dir(fullfile(prefix, places{k}{:}, name{1}))]; %#ok<AGROW>
    end
end
if isempty(library)
    error('capsule:build', 'no static library of the name capsule under %s', prefix);
end
archive = fullfile(library(1).folder, library(1).name);
include = ['-I' fullfile(prefix, 'include', 'capsule')];
names = {'capsule_simulate', 'capsule_many'};
for k = 1:numel(names)
    source = fullfile(here, [names{k} '.c']);
    if exist('OCTAVE_VERSION', 'builtin')
        mkoctfile('--mex', include, source, archive, '-lm', '-o', fullfile(folder, names{k}));
    else
        mex('-R2017b', include, source, archive, '-outdir', folder, '-output', names{k});
    end
    if nargin > 1
        copyfile(fullfile(here, [names{k} '.m']), folder);
    end
end
rehash();
end
