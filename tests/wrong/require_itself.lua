-- expect: 3: require: "require_itself" requires itself, directly or through other files
local rd = require "refdyn"
local parts = require "require_itself"
