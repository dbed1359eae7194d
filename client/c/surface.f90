! usage: surface_fortran BODIES.obj. The ball and the drop of surface.c in Fortran with
! iso_c_binding, in this process. To build it against an installed PartiEMC:
!
!   gfortran surface.f90 $(pkg-config --libs partiemc-c) -o surface_fortran
program surfaces
  use, intrinsic :: iso_c_binding
  implicit none
  integer(c_int32_t), parameter :: float64 = 2

  ! Structs of partiemc.h up to the last member used here; `size` gives their length. Components
  ! with a default value are not set below.
  type, bind(c) :: partiemc_options
    integer(c_size_t) :: size
    real(c_double) :: spacing
    type(c_ptr) :: placement = c_null_ptr, fill = c_null_ptr, plane = c_null_ptr
    real(c_double) :: kernel_radius = 0, cell_size = 0
    integer(c_int32_t) :: normals = 0, latest = 0, threads = 0
    type(c_ptr) :: name = c_null_ptr
    integer(c_int32_t) :: echo_particles = 0, tls = 0
    type(c_ptr) :: ca_file = c_null_ptr, cert_file = c_null_ptr, key_file = c_null_ptr
    type(c_ptr) :: token_file = c_null_ptr, token = c_null_ptr
    real(c_double) :: connect_timeout = 0, deadline = 0, give_up_after = 0, send_timeout = 0
    integer(c_int32_t) :: parts = 0, part = 0
    type(c_ptr) :: parts_token = c_null_ptr
    real(c_double) :: part_timeout = 0
    type(c_ptr) :: attributes = c_null_ptr, slice = c_null_ptr
    real(c_double) :: isovalue = 0
    type(c_ptr) :: sections = c_null_ptr
    integer(c_size_t) :: section_count = 0
    real(c_double) :: attribute_tolerance = 0
    type(c_ptr) :: output
  end type
  type, bind(c) :: partiemc_array
    type(c_ptr) :: first
    integer(c_ptrdiff_t) :: stride
    integer(c_int32_t) :: type
  end type
  type, bind(c) :: partiemc_particles
    integer(c_size_t) :: size, count
    type(partiemc_array) :: x, y, z
  end type
  type, bind(c) :: partiemc_surface
    integer(c_size_t) :: shell_count, point_count, triangle_count
    type(c_ptr) :: points, normals, triangles
  end type
  type, bind(c) :: partiemc_event
    integer(c_size_t) :: size
    integer(c_int32_t) :: kind
    integer(c_int64_t) :: sequence
    real(c_double) :: time
    type(c_ptr) :: message, reason, field, value, rule
    integer(c_size_t) :: ring_count, ring_point_count
    type(c_ptr) :: ring_points, offsets, outer_of, rings, ring_normals
    integer(c_size_t) :: mesh_point_count, mesh_triangle_count
    type(c_ptr) :: mesh_points, mesh_triangles, triangle_classes
    integer(c_int64_t) :: particle_count
    real(c_double) :: area, perimeter, spacing, cell_size, milliseconds
    integer(c_int64_t) :: rings_digest, mesh_digest
    integer(c_size_t) :: attribute_count
    type(c_ptr) :: attributes
    integer(c_size_t) :: section_count
    type(c_ptr) :: surface
    real(c_double) :: volume
    integer(c_int64_t) :: surface_digest
  end type

  interface
    integer(c_int32_t) function partiemc_open(address, options, stream) bind(c)
      import :: c_int32_t, c_ptr, partiemc_options
      type(c_ptr), value :: address
      type(partiemc_options), intent(in) :: options
      type(c_ptr), intent(out) :: stream
    end function
    integer(c_int32_t) function partiemc_reconstruct(stream, particles, time, event) bind(c)
      import :: c_int32_t, c_ptr, c_double, partiemc_particles, partiemc_event
      type(c_ptr), value :: stream
      type(partiemc_particles), intent(in) :: particles
      real(c_double), value :: time
      type(partiemc_event), intent(inout) :: event
    end function
    subroutine partiemc_close(stream) bind(c)
      import :: c_ptr
      type(c_ptr), value :: stream
    end subroutine
  end interface

  character(kind=c_char), target :: output(8) = ["s", "u", "r", "f", "a", "c", "e", c_null_char]
  real(c_double), target :: at(3, 2000)
  type(partiemc_options) :: options
  type(partiemc_particles) :: particles
  type(partiemc_event) :: event
  type(partiemc_surface), pointer :: surface
  type(c_ptr) :: stream
  character(1000) :: path
  integer :: step, count

  if (command_argument_count() /= 1) error stop "usage: surface_fortran BODIES.obj"
  call get_command_argument(1, path)
  options%size = c_sizeof(options)
  options%spacing = 0.01d0
  options%output = c_loc(output)
  if (partiemc_open(c_null_ptr, options, stream) /= 0) error stop "partiemc_open"
  particles%size = c_sizeof(particles)
  particles%x = partiemc_array(c_loc(at(1, 1)), 24, float64)
  particles%y = partiemc_array(c_loc(at(2, 1)), 24, float64)
  particles%z = partiemc_array(c_loc(at(3, 1)), 24, float64)
  event%size = c_sizeof(event)
  do step = 0, 4
    count = 0
    call add_ball(6, 0d0, -0.002d0 * step * step)
    call add_ball(2, 0.1d0, 0d0)
    particles%count = count
    if (partiemc_reconstruct(stream, particles, 0.1d0 * step, event) /= 0) error stop "reconstruct"
    call c_f_pointer(event%surface, surface)
    print '(i0, a, f0.9, a, z16.16)', surface%shell_count, " bodies, volume ", event%volume, ", ", &
      event%surface_digest
  end do
  call write_obj(surface)
  call partiemc_close(stream)

contains

  ! Adds the particles of a ball behind the first `count`.
  subroutine add_ball(radius, centre, height)
    integer, intent(in) :: radius
    real(c_double), intent(in) :: centre, height
    integer :: x, y, z
    do x = -radius, radius
      do y = -radius, radius
        do z = -radius, radius
          if (x * x + y * y + z * z > radius * radius) cycle
          count = count + 1
          at(:, count) = [centre + 0.01d0 * x, 0.01d0 * y, height + 0.01d0 * z]
        end do
      end do
    end do
  end subroutine

  subroutine write_obj(surface)
    type(partiemc_surface), intent(in) :: surface
    real(c_double), pointer :: points(:, :)
    real(c_float), pointer :: normals(:, :)
    integer(c_int32_t), pointer :: triangles(:, :)
    integer :: file, k
    call c_f_pointer(surface%points, points, [3_c_size_t, surface%point_count])
    call c_f_pointer(surface%normals, normals, [3_c_size_t, surface%point_count])
    call c_f_pointer(surface%triangles, triangles, [3_c_size_t, surface%triangle_count])
    open (newunit=file, file=trim(path), action="write", status="replace")
    do k = 1, size(points, 2)
      write (file, '(a, 3(1x, es16.9))') "v", points(:, k)
      write (file, '(a, 3(1x, es13.6))') "vn", normals(:, k)
    end do
    do k = 1, size(triangles, 2)
      write (file, '(a, 3(1x, i0, "//", i0))') "f", spread(triangles(:, k) + 1, 1, 2)
    end do
    close (file)
  end subroutine
end program
