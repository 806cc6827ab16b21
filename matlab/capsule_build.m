function capsule_build(prefix)
%CAPSULE_BUILD  Compile the gateways to the C library, in MATLAB and in Octave.
%   CAPSULE_BUILD(prefix) compiles CAPSULE_SIMULATE and CAPSULE_MANY beside this file against the C
%   library that `cmake --install` put under prefix. They hold the library: it may go afterwards.
%
%   See also CAPSULE_SIMULATE, CAPSULE_MANY.
here = fileparts(mfilename('fullpath'));
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
        mkoctfile('--mex', include, source, archive, '-lm', '-o', fullfile(here, names{k}));
    else
        mex('-R2017b', include, source, archive, '-outdir', here, '-output', names{k});
    end
end
rehash();
end
